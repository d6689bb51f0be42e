/* The two-state model as CVODES wants it. */
#include "two_state.h"

int ode_rhs(sunrealtype t, N_Vector y, N_Vector ydot, void *user) {
  const Model *model = user;
  const double *x = NV_DATA_S(y);
  double *xdot = NV_DATA_S(ydot);
  (void)t;
  xdot[0] = (x[1] - model->q_out) / AREA;
  xdot[1] = imbalance(model, x[0], x[1]) / model->p[0];
  return 0;
}

int ode_jacobian(sunrealtype t, N_Vector y, N_Vector ydot, SUNMatrix jacobian, void *user,
                 N_Vector a, N_Vector b, N_Vector c) {
  const Model *model = user;
  (void)t, (void)ydot, (void)a, (void)b, (void)c;
  SM_ELEMENT_D(jacobian, 0, 0) = 0;
  SM_ELEMENT_D(jacobian, 0, 1) = 1 / AREA;
  SM_ELEMENT_D(jacobian, 1, 0) = by_level(model);
  SM_ELEMENT_D(jacobian, 1, 1) = by_flow(model, NV_Ith_S(y, 1));
  return 0;
}

/* `ydot` is not used: with simultaneous functional iteration CVODES 6 passes another vector in its
   place (cvNlsFPFunctionSensSim overwrites it before this is called). */
int ode_sensitivities(int count, sunrealtype t, N_Vector y, N_Vector ydot, N_Vector *s,
                      N_Vector *sdot, void *user, N_Vector a, N_Vector b) {
  const Model *model = user;
  const double h = NV_Ith_S(y, 0), q = NV_Ith_S(y, 1);
  const double slope_h = by_level(model), slope_q = by_flow(model, q);
  double forcing[SENSITIVITIES];
  (void)t, (void)ydot, (void)a, (void)b;
  by_theta(model, h, q, forcing);
  for (int j = 0; j < count; j++) {
    const double *x = NV_DATA_S(s[j]);
    double *xdot = NV_DATA_S(sdot[j]);
    xdot[0] = x[1] / AREA;
    xdot[1] = slope_h * x[0] + slope_q * x[1] + forcing[j];
  }
  return 0;
}

N_Vector absolute_tolerances(double rtol, SUNContext context) {
  N_Vector atol = N_VNew_Serial(2, context);
  NV_Ith_S(atol, 0) = 0.01 * rtol * LEVEL;
  NV_Ith_S(atol, 1) = 0.01 * rtol * FLOW;
  return atol;
}

void write_row(double *row, N_Vector y, N_Vector *s) {
  row[0] = NV_Ith_S(y, 0);
  row[1] = NV_Ith_S(y, 1);
  for (int j = 0; s && j < SENSITIVITIES; j++) {
    row[2 + 2 * j] = NV_Ith_S(s[j], 0);
    row[3 + 2 * j] = NV_Ith_S(s[j], 1);
  }
}
