/* SUNDIALS CVODE (BDF, dense matrix, analytic Jacobian) on one case at one tolerance:
 *
 *     cvode a b inertia k z y x t_end force tolerance
 *
 * Prints the least time of several integrations in seconds, the state at the end, the number of peaks and ln(v/v_f) at
 * the first; nothing if CVODE gives up. Peaks are found as in `src/peaks.rs`. */
#include <cvode/cvode.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdio.h>
#include <stdlib.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <time.h>

enum { Z, Y, X, N, PARTS = 8 };

static double a, b, inertia, k;

static int slope(double t, N_Vector at, N_Vector result, void *data) {
    (void)t, (void)data;
    const double *state = N_VGetArrayPointer_Serial(at);
    double *out = N_VGetArrayPointer_Serial(result);
    double v = exp(state[X]), ageing = exp(-state[Y]);
    out[Z] = k * (1 - v);
    out[Y] = ageing - v;
    out[X] = (state[Z] - a * state[X] - b * state[Y]) / (inertia * v);
    return 0;
}

static int jacobian(double t, N_Vector at, N_Vector f, SUNMatrix matrix, void *data, N_Vector t1, N_Vector t2,
                    N_Vector t3) {
    (void)t, (void)f, (void)data, (void)t1, (void)t2, (void)t3;
    const double *state = N_VGetArrayPointer_Serial(at);
    double v = exp(state[X]), ageing = exp(-state[Y]), rate = 1 / (inertia * v);
    double pull = state[Z] - a * state[X] - b * state[Y];
    SM_ELEMENT_D(matrix, Z, Z) = 0;
    SM_ELEMENT_D(matrix, Z, Y) = 0;
    SM_ELEMENT_D(matrix, Z, X) = -k * v;
    SM_ELEMENT_D(matrix, Y, Z) = 0;
    SM_ELEMENT_D(matrix, Y, Y) = -ageing;
    SM_ELEMENT_D(matrix, Y, X) = -v;
    SM_ELEMENT_D(matrix, X, Z) = rate;
    SM_ELEMENT_D(matrix, X, Y) = -b * rate;
    SM_ELEMENT_D(matrix, X, X) = -(a + pull) * rate;
    return 0;
}

static int peaks, falls, started;
static double first, extreme;

static void pass(double x) {
    if (!started) extreme = x, started = 1;
    double change = falls ? extreme - x : x - extreme;
    if (change >= 0) {
        extreme = x;
    } else if (change < -0.01) {
        if (!falls && extreme > 0 && peaks++ == 0) first = extreme;
        falls = !falls;
        extreme = x;
    }
}

static double value(void *solver, double t, N_Vector at) {
    return CVodeGetDky(solver, t, 0, at) == CV_SUCCESS ? N_VGetArrayPointer_Serial(at)[X] : NAN;
}

static double maximum(void *solver, double from, double to, N_Vector at) {
    const double golden = 0.6180339887498948;
    double inner[2] = {to - golden * (to - from), from + golden * (to - from)};
    double high[2] = {value(solver, inner[0], at), value(solver, inner[1], at)};
    for (int i = 0; i < 60; i++) {
        if (high[0] > high[1]) {
            to = inner[1], inner[1] = inner[0], high[1] = high[0];
            inner[0] = to - golden * (to - from), high[0] = value(solver, inner[0], at);
        } else {
            from = inner[0], inner[0] = inner[1], high[0] = high[1];
            inner[1] = from + golden * (to - from), high[1] = value(solver, inner[1], at);
        }
    }
    return fmax(high[0], high[1]);
}

static void look(void *solver, double before, double after, N_Vector at) {
    double sample[PARTS + 1];
    int highest = 0;
    for (int i = 0; i <= PARTS; i++) {
        sample[i] = value(solver, i == PARTS ? after : before + i * (after - before) / PARTS, at);
        if (sample[i] > sample[highest]) highest = i;
    }
    double part = (after - before) / PARTS, top = NAN;
    if (sample[highest] > 0)
        top = maximum(solver, fmax(before, before + (highest - 1) * part), fmin(after, before + (highest + 1) * part),
                      at);
    for (int i = 0; i <= PARTS; i++) {
        pass(sample[i]);
        if (i == highest && sample[highest] > 0) pass(top);
    }
}

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* One integration to `end`; 0 if CVODE gives up. */
static int integrate(SUNContext context, const double start[N], double t_end, double force, double tolerance, int looks,
                     double end[N]) {
    N_Vector state = N_VNew_Serial(N, context), absolute = N_VNew_Serial(N, context), at = N_VNew_Serial(N, context);
    for (int r = 0; r < N; r++) {
        N_VGetArrayPointer_Serial(state)[r] = start[r];
        N_VGetArrayPointer_Serial(absolute)[r] = tolerance * (r == Z ? force : 1);
    }
    void *solver = CVodeCreate(CV_BDF, context);
    SUNMatrix matrix = SUNDenseMatrix(N, N, context);
    SUNLinearSolver linear = SUNLinSol_Dense(state, matrix, context);
    CVodeInit(solver, slope, 0, state);
    CVodeSVtolerances(solver, tolerance, absolute);
    CVodeSetLinearSolver(solver, linear, matrix);
    CVodeSetJacFn(solver, jacobian);
    CVodeSetMaxNumSteps(solver, -1);
    CVodeSetStopTime(solver, t_end);
    CVodeSetErrFile(solver, NULL);
    double t = 0;
    int flag = CV_SUCCESS;
    while (flag == CV_SUCCESS && t < t_end) {
        double before = t;
        flag = CVode(solver, t_end, state, &t, CV_ONE_STEP);
        if (looks && flag >= 0) look(solver, before, t, at);
    }
    for (int r = 0; r < N; r++) end[r] = N_VGetArrayPointer_Serial(state)[r];
    CVodeFree(&solver);
    SUNLinSolFree(linear);
    SUNMatDestroy(matrix);
    N_VDestroy(state);
    N_VDestroy(absolute);
    N_VDestroy(at);
    return flag >= 0;
}

int main(int count, char **argument) {
    if (count != 11) return 1;
    double number[10];
    for (int i = 0; i < 10; i++) number[i] = strtod(argument[i + 1], NULL);
    a = number[0], b = number[1], inertia = number[2], k = number[3];
    SUNContext context;
    if (SUNContext_Create(NULL, &context)) return 1;
    double end[N], least = INFINITY, spent = 0;
    if (!integrate(context, number + 4, number[7], number[8], number[9], 1, end)) return 0;
    for (int i = 0; i < 5 || (i < 50 && spent < 0.3); i++) {
        double from = now();
        integrate(context, number + 4, number[7], number[8], number[9], 0, end);
        double time = now() - from;
        least = fmin(least, time), spent += time;
    }
    printf("%.9e %.17g %.17g %.17g %d %.17g\n", least, end[Z], end[Y], end[X], peaks, first);
}
