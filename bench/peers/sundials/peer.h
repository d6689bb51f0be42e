/* What the driver asks and how it is answered; see ../problems/src/request.rs. */
#ifndef PEER_H
#define PEER_H

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include <sundials/sundials_context.h>

typedef struct {
  const char *problem, *method;
  double rtol, span;
  const char *data, *output;
} Request;

/* Writes a run's values and returns its steps. */
typedef long (*Run)(void *what, double *values);

double now(void);

/* Repeats a run until the span is over, at least three times; writes and prints the answer. */
void measure(const Request *request, Run run, void *what, size_t count);

SUNContext new_context(void);

void solve_two_state(const Request *request);
void solve_line(const Request *request, long cells);
void solve_recording(const Request *request);

/* SUNDIALS says with a negative number that it failed. */
#define CHECK(call)                                                        \
  do {                                                                     \
    int flag_ = (call);                                                    \
    if (flag_ < 0) {                                                       \
      fprintf(stderr, "%s:%d: %s gave %d\n", __FILE__, __LINE__, #call, flag_); \
      exit(1);                                                             \
    }                                                                      \
  } while (0)

#endif
