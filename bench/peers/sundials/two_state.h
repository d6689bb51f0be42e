/* A level and a flow, and five sensitivities to theta = p/p_nominal; see ../problems/src/two_state.rs. */
#ifndef TWO_STATE_H
#define TWO_STATE_H

#include <nvector/nvector_serial.h>
#include <sundials/sundials_types.h>
#include <sunmatrix/sunmatrix_dense.h>

#define RHO_G (1120.0 * 9.81)
#define AREA 0.1976
#define FLOW 0.032
#define LEVEL 40.0
enum { SENSITIVITIES = 5, WIDTH = 2 + 2 * SENSITIVITIES };

typedef struct {
  double p[5]; /* M, c0, c1, c2, F */
  double w, q_out;
  double theta[5]; /* all one: CVODES wants to know where they are */
} Model;

static inline Model model_at_rest(void) {
  const double w = 0.8, c1 = 500, c2 = 2e4, f = 3e8;
  const double losses = f * FLOW * FLOW / RHO_G + c1 * w * FLOW + c2 * FLOW * FLOW;
  return (Model){{1.1e8, (LEVEL - 5 + losses) / (w * w), c1, c2, f}, w, FLOW, {1, 1, 1, 1, 1}};
}

/* Pressure that accelerates the flow. */
static inline double imbalance(const Model *model, double h, double q) {
  const double *p = model->p, w = model->w;
  return RHO_G * (5 - h + p[1] * w * w - p[2] * w * q - p[3] * q * q) - p[4] * q * q;
}

/* d qdot/dh and d qdot/dq. */
static inline double by_level(const Model *model) { return -RHO_G / model->p[0]; }
static inline double by_flow(const Model *model, double q) {
  const double *p = model->p;
  return (-RHO_G * p[2] * model->w - 2 * (RHO_G * p[3] + p[4]) * q) / p[0];
}

/* d qdot/d theta. */
static inline void by_theta(const Model *model, double h, double q, double *result) {
  const double *p = model->p, w = model->w, inverse = 1 / p[0];
  result[0] = -imbalance(model, h, q) * inverse;
  result[1] = RHO_G * p[1] * w * w * inverse;
  result[2] = -RHO_G * p[2] * w * q * inverse;
  result[3] = -RHO_G * p[3] * q * q * inverse;
  result[4] = -p[4] * q * q * inverse;
}

/* CVODES' right side, Jacobian and sensitivity equations. */
int ode_rhs(sunrealtype t, N_Vector y, N_Vector ydot, void *model);
int ode_jacobian(sunrealtype t, N_Vector y, N_Vector ydot, SUNMatrix jacobian, void *model,
                 N_Vector a, N_Vector b, N_Vector c);
int ode_sensitivities(int count, sunrealtype t, N_Vector y, N_Vector ydot, N_Vector *s,
                      N_Vector *sdot, void *model, N_Vector a, N_Vector b);

/* Absolute tolerances of states and of each sensitivity: a hundredth of rtol, of the sizes. */
N_Vector absolute_tolerances(double rtol, SUNContext context);

/* Row of states and, where there are any, sensitivities. */
void write_row(double *row, N_Vector y, N_Vector *s);

#endif
