/* P1, P2 and P4: a jump of the speed at 100 s, where the solver starts over. */
#include "two_state.h"

#include <string.h>

#include <cvodes/cvodes.h>
#include <idas/idas.h>
#include <sunlinsol/sunlinsol_dense.h>

#include "peer.h"

enum { OUTPUTS = 1001, JUMP = 100, SETS = 10000 };
static const double SPEED[2] = {0.8, 0.88};

typedef struct {
  const Request *request;
  int algebraic, sensitivities, how;
  Model model;
} Problem;

/* A solver and what it works on. */
typedef struct {
  SUNContext context;
  void *memory;
  N_Vector y, ydot, *s, *sdot;
  SUNMatrix matrix;
  SUNLinearSolver linear;
} Solver;

/* IDAS: 0 = ydot0 − f0, 0 = f1. */
static int residual(sunrealtype t, N_Vector y, N_Vector ydot, N_Vector r, void *user) {
  const Model *model = user;
  const double *x = NV_DATA_S(y);
  double *result = NV_DATA_S(r);
  (void)t;
  result[0] = NV_Ith_S(ydot, 0) - (x[1] - model->q_out) / AREA;
  result[1] = imbalance(model, x[0], x[1]) / model->p[0];
  return 0;
}

static int residual_jacobian(sunrealtype t, sunrealtype c, N_Vector y, N_Vector ydot, N_Vector r,
                             SUNMatrix jacobian, void *user, N_Vector a, N_Vector b, N_Vector d) {
  const Model *model = user;
  (void)t, (void)ydot, (void)r, (void)a, (void)b, (void)d;
  SM_ELEMENT_D(jacobian, 0, 0) = c;
  SM_ELEMENT_D(jacobian, 0, 1) = -1 / AREA;
  SM_ELEMENT_D(jacobian, 1, 0) = by_level(model);
  SM_ELEMENT_D(jacobian, 1, 1) = by_flow(model, NV_Ith_S(y, 1));
  return 0;
}

static int residual_sensitivities(int count, sunrealtype t, N_Vector y, N_Vector ydot, N_Vector r,
                                  N_Vector *s, N_Vector *sdot, N_Vector *rs, void *user,
                                  N_Vector a, N_Vector b, N_Vector c) {
  const Model *model = user;
  const double h = NV_Ith_S(y, 0), q = NV_Ith_S(y, 1);
  const double slope_h = by_level(model), slope_q = by_flow(model, q);
  double forcing[SENSITIVITIES];
  (void)t, (void)ydot, (void)r, (void)a, (void)b, (void)c;
  by_theta(model, h, q, forcing);
  forcing[0] = 0; /* the static model has no M */
  for (int j = 0; j < count; j++) {
    const double *x = NV_DATA_S(s[j]);
    double *result = NV_DATA_S(rs[j]);
    result[0] = NV_Ith_S(sdot[j], 0) - x[1] / AREA;
    result[1] = slope_h * x[0] + slope_q * x[1] + forcing[j];
  }
  return 0;
}

static void start_values(const Problem *problem, Solver *solver) {
  NV_Ith_S(solver->y, 0) = LEVEL;
  NV_Ith_S(solver->y, 1) = FLOW;
  N_VConst(0, solver->ydot);
  for (int j = 0; problem->sensitivities && j < SENSITIVITIES; j++) {
    N_VConst(0, solver->s[j]);
    N_VConst(0, solver->sdot[j]);
  }
}

static void create(Problem *problem, Solver *solver) {
  const double rtol = problem->request->rtol;
  SUNContext context = solver->context = new_context();
  solver->y = N_VNew_Serial(2, context);
  solver->ydot = N_VClone(solver->y);
  solver->matrix = SUNDenseMatrix(2, 2, context);
  solver->linear = SUNLinSol_Dense(solver->y, solver->matrix, context);
  solver->s = solver->sdot = NULL;
  if (problem->sensitivities) {
    solver->s = N_VCloneVectorArray(SENSITIVITIES, solver->y);
    solver->sdot = N_VCloneVectorArray(SENSITIVITIES, solver->y);
  }
  start_values(problem, solver);
  N_Vector atol = absolute_tolerances(rtol, context), s_atol[SENSITIVITIES];
  for (int j = 0; j < SENSITIVITIES; j++) s_atol[j] = atol;

  Model *model = &problem->model;
  if (problem->algebraic) {
    void *ida = solver->memory = IDACreate(context);
    CHECK(IDAInit(ida, residual, 0, solver->y, solver->ydot));
    CHECK(IDASVtolerances(ida, rtol, atol));
    CHECK(IDASetUserData(ida, model));
    CHECK(IDASetLinearSolver(ida, solver->linear, solver->matrix));
    CHECK(IDASetJacFn(ida, residual_jacobian));
    CHECK(IDASetMaxNumSteps(ida, 100000));
    N_Vector differential = N_VClone(solver->y);
    NV_Ith_S(differential, 0) = 1;
    NV_Ith_S(differential, 1) = 0;
    CHECK(IDASetId(ida, differential));
    N_VDestroy(differential);
    if (problem->sensitivities) {
      CHECK(IDASensInit(ida, SENSITIVITIES, problem->how, residual_sensitivities, solver->s,
                        solver->sdot));
      CHECK(IDASensSVtolerances(ida, rtol, s_atol));
      CHECK(IDASetSensErrCon(ida, 1));
      CHECK(IDASetSensParams(ida, model->theta, model->theta, NULL));
    }
  } else {
    void *cvode = solver->memory = CVodeCreate(CV_BDF, context);
    CHECK(CVodeInit(cvode, ode_rhs, 0, solver->y));
    CHECK(CVodeSVtolerances(cvode, rtol, atol));
    CHECK(CVodeSetUserData(cvode, model));
    CHECK(CVodeSetLinearSolver(cvode, solver->linear, solver->matrix));
    CHECK(CVodeSetJacFn(cvode, ode_jacobian));
    CHECK(CVodeSetMaxNumSteps(cvode, 100000));
    if (problem->sensitivities) {
      CHECK(CVodeSensInit(cvode, SENSITIVITIES, problem->how, ode_sensitivities, solver->s));
      CHECK(CVodeSensSVtolerances(cvode, rtol, s_atol));
      CHECK(CVodeSetSensErrCon(cvode, 1));
      CHECK(CVodeSetSensParams(cvode, model->theta, model->theta, NULL));
    }
  }
  N_VDestroy(atol);
}

static void destroy(const Problem *problem, Solver *solver) {
  if (problem->algebraic)
    IDAFree(&solver->memory);
  else
    CVodeFree(&solver->memory);
  SUNLinSolFree(solver->linear);
  SUNMatDestroy(solver->matrix);
  if (solver->s) {
    N_VDestroyVectorArray(solver->s, SENSITIVITIES);
    N_VDestroyVectorArray(solver->sdot, SENSITIVITIES);
  }
  N_VDestroy(solver->y);
  N_VDestroy(solver->ydot);
  SUNContext_Free(&solver->context);
}

/* Starts over at `from`, from the values that the solver's vectors have. */
static void restart(const Problem *problem, Solver *solver, double from) {
  if (problem->algebraic) {
    CHECK(IDAReInit(solver->memory, from, solver->y, solver->ydot));
    if (solver->s)
      CHECK(IDASensReInit(solver->memory, problem->how, solver->s, solver->sdot));
  } else {
    CHECK(CVodeReInit(solver->memory, from, solver->y));
    if (solver->s) CHECK(CVodeSensReInit(solver->memory, problem->how, solver->s));
  }
}

/* From `from` to `to` with outputs at whole seconds; returns the steps. */
static long stretch(const Problem *problem, Solver *solver, int from, int to, double *values) {
  const size_t width = solver->s ? WIDTH : 2;
  long steps = 0;
  double t;
  if (problem->algebraic) {
    /* Far enough ahead to tell the direction and the scale of time. */
    CHECK(IDACalcIC(solver->memory, IDA_YA_YDP_INIT, from + 1.0));
    CHECK(IDAGetConsistentIC(solver->memory, solver->y, solver->ydot));
    if (solver->s) CHECK(IDAGetSensConsistentIC(solver->memory, solver->s, solver->sdot));
    CHECK(IDASetStopTime(solver->memory, to));
  } else {
    CHECK(CVodeSetStopTime(solver->memory, to));
  }
  if (from == 0) write_row(values, solver->y, solver->s);
  for (int k = from + 1; k <= to; k++) {
    if (problem->algebraic) {
      CHECK(IDASolve(solver->memory, k, &t, solver->y, solver->ydot, IDA_NORMAL));
      if (solver->s) CHECK(IDAGetSens(solver->memory, &t, solver->s));
    } else {
      CHECK(CVode(solver->memory, k, solver->y, &t, CV_NORMAL));
      if (solver->s) CHECK(CVodeGetSens(solver->memory, &t, solver->s));
    }
    write_row(values + width * (size_t)k, solver->y, solver->s);
  }
  if (problem->algebraic)
    CHECK(IDAGetNumSteps(solver->memory, &steps));
  else
    CHECK(CVodeGetNumSteps(solver->memory, &steps));
  return steps;
}

/* Both stretches; the solver is at its start. */
static long simulate(Problem *problem, Solver *solver, double *values) {
  problem->model.w = SPEED[0];
  long steps = stretch(problem, solver, 0, JUMP, values);
  problem->model.w = SPEED[1];
  if (problem->algebraic && solver->s)
    for (int j = 0; j < SENSITIVITIES; j++)
      CHECK(IDAGetSensDky1(solver->memory, JUMP, 1, j, solver->sdot[j]));
  restart(problem, solver, JUMP);
  return steps + stretch(problem, solver, JUMP, OUTPUTS - 1, values);
}

static long run(void *what, double *values) {
  Problem *problem = what;
  Solver solver;
  create(problem, &solver);
  long steps = simulate(problem, &solver, values);
  destroy(problem, &solver);
  return steps;
}

/* The mean level over all parameter sets and outputs; one solver for all. */
static long ensemble(void *what, double *mean) {
  Problem *problem = what;
  static double values[2 * OUTPUTS];
  unsigned long long state = 12345;
  const Model nominal = model_at_rest();
  double sum = 0;
  long steps = 0;
  Solver solver;
  create(problem, &solver);
  for (int i = 0; i < SETS; i++) {
    for (int j = 0; j < 5; j++) {
      state = state * 6364136223846793005ULL + 1442695040888963407ULL;
      const double unit = (double)(state >> 11) / 9007199254740992.0;
      problem->model.p[j] = nominal.p[j] * (1 + 0.1 * (2 * unit - 1));
    }
    start_values(problem, &solver);
    restart(problem, &solver, 0);
    steps += simulate(problem, &solver, values);
    for (int k = 0; k < OUTPUTS; k++) sum += values[2 * k];
  }
  destroy(problem, &solver);
  *mean = sum / SETS / OUTPUTS;
  return steps;
}

void solve_two_state(const Request *request) {
  const char *name = request->problem;
  Problem problem = {request, name[1] == '2', name[2] == 'b', 0, model_at_rest()};
  const int staggered = !strcmp(request->method, "staggered");
  if (problem.algebraic)
    problem.how = staggered ? IDA_STAGGERED : IDA_SIMULTANEOUS;
  else
    problem.how = staggered ? CV_STAGGERED : CV_SIMULTANEOUS;
  if (!strcmp(name, "p4"))
    measure(request, ensemble, &problem, 1);
  else
    measure(request, run, &problem, OUTPUTS * (problem.sensitivities ? WIDTH : 2));
}
