/* The problems, solved with SUNDIALS: CVODES and IDAS. */
#include "peer.h"

#include <string.h>
#include <time.h>

#include <sundials/sundials_version.h>

double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

SUNContext new_context(void) {
  SUNContext context;
#if SUNDIALS_VERSION_MAJOR >= 7
  CHECK(SUNContext_Create(SUN_COMM_NULL, &context));
#else
  CHECK(SUNContext_Create(NULL, &context));
#endif
  return context;
}

/* Longer work than this is not repeated, s. */
#define LONG 10.0

/* Peak of the memory in use, bytes; 0 where the system does not tell. */
static long peak_memory(void) {
  char line[256];
  long kilobytes = 0;
  FILE *file = fopen("/proc/self/status", "r");
  while (file && fgets(line, sizeof line, file))
    if (!strncmp(line, "VmHWM:", 6)) kilobytes = atol(line + 6);
  if (file) fclose(file);
  return 1024 * kilobytes;
}

static int ascending(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

void measure(const Request *request, Run run, void *what, size_t count) {
  double *values = calloc(count, sizeof *values);
  size_t taken = 0, room = 1024;
  double *times = malloc(room * sizeof *times);
  long steps = 0;
  double begin = now();
  while (taken < 1 || (now() - begin < LONG && (taken < 3 || now() - begin < request->span))) {
    if (taken == room) times = realloc(times, (room *= 2) * sizeof *times);
    double start = now();
    steps = run(what, values);
    times[taken++] = now() - start;
  }
  qsort(times, taken, sizeof *times, ascending);

  FILE *file = fopen(request->output, "wb");
  if (!file || fwrite(values, sizeof *values, count, file) != count || fclose(file)) {
    fprintf(stderr, "cannot write %s\n", request->output);
    exit(1);
  }
  printf("least %e\nmedian %e\nsteps %ld\n", times[0], times[taken / 2], steps);
  if (peak_memory()) printf("memory %ld\n", peak_memory());
  free(times);
  free(values);
}

int main(int count, char **argument) {
  if (count == 2 && !strcmp(argument[1], "--version")) {
    puts(SUNDIALS_VERSION);
    return 0;
  }
  if (count != 7) {
    fprintf(stderr, "usage: CASE METHOD RTOL SPAN DATA OUTPUT\n");
    return 2;
  }
  Request request = {argument[1],       argument[2], atof(argument[3]),
                     atof(argument[4]), argument[5], argument[6]};
  if (!strncmp(request.problem, "p3-", 3))
    solve_line(&request, atol(request.problem + 3));
  else if (!strncmp(request.problem, "p5", 2))
    solve_recording(&request);
  else
    solve_two_state(&request);
  return 0;
}
