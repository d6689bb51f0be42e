/* P3: a hydraulic line of n cells with a banded Jacobian; see ../problems/src/line.rs.

   BDF of order 2 at most: higher orders are not A-stable, and near the imaginary axis, where a line
   has its eigenvalues, take a hundred times the steps. */
#include <math.h>

#include <cvodes/cvodes.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_band.h>
#include <sunmatrix/sunmatrix_band.h>

#include "peer.h"

#define PIPE_LENGTH 3000.0
#define BULK_MODULUS 1.5e9
#define PIPE_AREA 0.0185
#define DENSITY 1120.0
#define GRAVITY 9.81
#define FRICTION 3.0e4
#define OUTLET_PRESSURE 3.3e7
#define PIPE_FLOW 0.03
#define RAMP 0.5
enum { END = 20 };

typedef struct {
  const Request *request;
  long n;
  double dx;
} Line;

static double inlet_flow(double t) {
  const double x = fmin(fmax((t - 1) / RAMP, 0), 1);
  return PIPE_FLOW * (1 + 0.2 * x * x * x * (10 + x * (6 * x - 15)));
}

static int rhs(sunrealtype t, N_Vector y, N_Vector ydot, void *user) {
  const Line *line = user;
  const double stiffness = BULK_MODULUS / PIPE_AREA / line->dx;
  const double inertia = PIPE_AREA / DENSITY / line->dx;
  const double *x = NV_DATA_S(y);
  double *xdot = NV_DATA_S(ydot), before = inlet_flow(t);
  for (long i = 0; i < line->n; i++) {
    const double p = x[2 * i], q = x[2 * i + 1];
    const double after = i + 1 < line->n ? x[2 * i + 2] : OUTLET_PRESSURE;
    xdot[2 * i] = -stiffness * (q - before);
    xdot[2 * i + 1] =
        -inertia * (after - p) - FRICTION / DENSITY * q * fabs(q) + PIPE_AREA * GRAVITY;
    before = q;
  }
  return 0;
}

static int jacobian(sunrealtype t, N_Vector y, N_Vector ydot, SUNMatrix matrix, void *user,
                    N_Vector a, N_Vector b, N_Vector c) {
  const Line *line = user;
  const double stiffness = BULK_MODULUS / PIPE_AREA / line->dx;
  const double inertia = PIPE_AREA / DENSITY / line->dx;
  const double *x = NV_DATA_S(y);
  (void)t, (void)ydot, (void)a, (void)b, (void)c;
  for (long i = 0; i < line->n; i++) {
    const long p = 2 * i, q = p + 1;
    if (i > 0) SM_ELEMENT_B(matrix, p, p - 1) = stiffness;
    SM_ELEMENT_B(matrix, p, p) = 0;
    SM_ELEMENT_B(matrix, p, q) = -stiffness;
    SM_ELEMENT_B(matrix, q, p) = inertia;
    SM_ELEMENT_B(matrix, q, q) = -2 * FRICTION / DENSITY * fabs(x[q]);
    if (i + 1 < line->n) SM_ELEMENT_B(matrix, q, q + 1) = -inertia;
  }
  return 0;
}

static long run(void *what, double *pressures) {
  Line *line = what;
  const double rtol = line->request->rtol;
  SUNContext context = new_context();
  N_Vector y = N_VNew_Serial(2 * line->n, context), atol = N_VClone(y);
  double pressure = OUTLET_PRESSURE;
  for (long i = line->n - 1; i >= 0; i--) {
    pressure +=
        line->dx * (FRICTION * PIPE_FLOW * PIPE_FLOW / PIPE_AREA - DENSITY * GRAVITY);
    NV_Ith_S(y, 2 * i) = pressure;
    NV_Ith_S(y, 2 * i + 1) = PIPE_FLOW;
    NV_Ith_S(atol, 2 * i) = 1e6 * rtol;
    NV_Ith_S(atol, 2 * i + 1) = 1e-2 * rtol;
  }
  SUNMatrix matrix = SUNBandMatrix(2 * line->n, 1, 1, context);
  SUNLinearSolver linear = SUNLinSol_Band(y, matrix, context);
  void *cvode = CVodeCreate(CV_BDF, context);
  CHECK(CVodeInit(cvode, rhs, 0, y));
  CHECK(CVodeSVtolerances(cvode, rtol, atol));
  CHECK(CVodeSetUserData(cvode, line));
  CHECK(CVodeSetMaxNumSteps(cvode, 10000000));
  CHECK(CVodeSetMaxOrd(cvode, 2));
  CHECK(CVodeSetLinearSolver(cvode, linear, matrix));
  CHECK(CVodeSetJacFn(cvode, jacobian));

  double t;
  long steps;
  pressures[0] = NV_Ith_S(y, 0);
  for (int k = 1; k <= END; k++) {
    CHECK(CVode(cvode, k, y, &t, CV_NORMAL));
    pressures[k] = NV_Ith_S(y, 0);
  }
  CHECK(CVodeGetNumSteps(cvode, &steps));

  CVodeFree(&cvode);
  SUNLinSolFree(linear);
  SUNMatDestroy(matrix);
  N_VDestroy(atol);
  N_VDestroy(y);
  SUNContext_Free(&context);
  return steps;
}

void solve_line(const Request *request, long cells) {
  Line line = {request, cells, PIPE_LENGTH / (double)cells};
  measure(request, run, &line, END + 1);
}
