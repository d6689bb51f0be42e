/* P5: 6000 s at 1 Hz, inputs that change every second.

   The fastest way that was found: start over at each sample, with a first step that is the best of
   several for the whole recording. Keeping the history over a jump costs more and errs more. */
#include <math.h>
#include <string.h>

#include <cvodes/cvodes.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include "peer.h"
#include "two_state.h"

enum { SAMPLES = 6001 };

typedef struct {
  const Request *request;
  int adams, sensitivities;
  double first_step;
  double (*inputs)[3];
} Problem;

static long run(void *what, double *values) {
  const Problem *problem = what;
  const double rtol = problem->request->rtol;
  const size_t width = problem->sensitivities ? WIDTH : 2;
  Model model = model_at_rest();
  SUNContext context = new_context();
  N_Vector y = N_VNew_Serial(2, context), *s = NULL;
  N_Vector atol = absolute_tolerances(rtol, context), s_atol[SENSITIVITIES];
  SUNMatrix matrix = NULL;
  SUNLinearSolver linear = NULL;
  SUNNonlinearSolver iteration = NULL, s_iteration = NULL;
  NV_Ith_S(y, 0) = LEVEL;
  NV_Ith_S(y, 1) = FLOW;

  void *cvode = CVodeCreate(problem->adams ? CV_ADAMS : CV_BDF, context);
  CHECK(CVodeInit(cvode, ode_rhs, 0, y));
  CHECK(CVodeSVtolerances(cvode, rtol, atol));
  CHECK(CVodeSetUserData(cvode, &model));
  CHECK(CVodeSetMaxNumSteps(cvode, 1000000));
  if (problem->adams) {
    iteration = SUNNonlinSol_FixedPoint(y, 0, context);
    CHECK(CVodeSetNonlinearSolver(cvode, iteration));
  } else {
    matrix = SUNDenseMatrix(2, 2, context);
    linear = SUNLinSol_Dense(y, matrix, context);
    CHECK(CVodeSetLinearSolver(cvode, linear, matrix));
    CHECK(CVodeSetJacFn(cvode, ode_jacobian));
  }
  if (problem->sensitivities) {
    s = N_VCloneVectorArray(SENSITIVITIES, y);
    for (int j = 0; j < SENSITIVITIES; j++) {
      N_VConst(0, s[j]);
      s_atol[j] = atol;
    }
    CHECK(CVodeSensInit(cvode, SENSITIVITIES, CV_STAGGERED, ode_sensitivities, s));
    CHECK(CVodeSensSVtolerances(cvode, rtol, s_atol));
    CHECK(CVodeSetSensErrCon(cvode, 1));
    CHECK(CVodeSetSensParams(cvode, model.theta, model.theta, NULL));
    if (problem->adams) {
      s_iteration = SUNNonlinSol_FixedPointSens(SENSITIVITIES, y, 0, context);
      CHECK(CVodeSetNonlinearSolverSensStg(cvode, s_iteration));
    }
  }

  long steps = 0, taken;
  double t;
  write_row(values, y, s);
  for (int k = 0; k < SAMPLES - 1; k++) {
    model.w = problem->inputs[k][0];
    model.q_out = problem->inputs[k][1] + problem->inputs[k][2];
    if (k > 0) {
      CHECK(CVodeGetNumSteps(cvode, &taken));
      steps += taken;
      CHECK(CVodeReInit(cvode, k, y));
      if (s) CHECK(CVodeSensReInit(cvode, CV_STAGGERED, s));
    }
    CHECK(CVodeSetInitStep(cvode, problem->first_step));
    CHECK(CVodeSetStopTime(cvode, k + 1));
    CHECK(CVode(cvode, k + 1, y, &t, CV_NORMAL));
    if (s) CHECK(CVodeGetSens(cvode, &t, s));
    write_row(values + width * (size_t)(k + 1), y, s);
  }
  CHECK(CVodeGetNumSteps(cvode, &taken));
  steps += taken;

  CVodeFree(&cvode);
  if (linear) SUNLinSolFree(linear);
  if (matrix) SUNMatDestroy(matrix);
  if (iteration) SUNNonlinSolFree(iteration);
  if (s_iteration) SUNNonlinSolFree(s_iteration);
  if (s) N_VDestroyVectorArray(s, SENSITIVITIES);
  N_VDestroy(atol);
  N_VDestroy(y);
  SUNContext_Free(&context);
  return steps;
}

void solve_recording(const Request *request) {
  static double inputs[SAMPLES][3], values[SAMPLES * WIDTH];
  static const double first_steps[] = {1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1};
  char path[4096];
  snprintf(path, sizeof path, "%s/recording.bin", request->data);
  FILE *file = fopen(path, "rb");
  if (!file || fread(inputs, sizeof inputs, 1, file) != 1) {
    fprintf(stderr, "cannot read %s\n", path);
    exit(1);
  }
  fclose(file);

  Problem problem = {request, !strcmp(request->method, "adams"), request->problem[2] == 'b', 0,
                     inputs};
  double least = INFINITY, best = first_steps[0];
  for (size_t i = 0; i < sizeof first_steps / sizeof *first_steps; i++) {
    problem.first_step = first_steps[i];
    const double start = now();
    run(&problem, values);
    const double taken = now() - start;
    if (taken < least) least = taken, best = first_steps[i];
  }
  problem.first_step = best;
  measure(request, run, &problem, SAMPLES * (problem.sensitivities ? WIDTH : 2));
}
