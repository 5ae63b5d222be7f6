/* Reference values of `src/case.rs`, independent of the crate: collocation with 8 stages in quadruple precision, once
 * Gauss (order 16) and once Radau IIA (order 15), each at two step sizes.
 *
 *     cc -O2 -ffp-contract=off benches/peers/reference.c -lquadmath -lm -o reference && ./reference
 *
 * Prints the state at the end and the first peak, with the size of the change since the line before. */
#include <math.h>
#include <quadmath.h>
#include <stdio.h>
#include <string.h>

enum { S = 8, P = S + 1, N = 3, U = N * S, Z = 0, Y = 1, X = 2 };
typedef __float128 quad;

static quad node[P], slope_of[P][P], last[P];

/* Zeros of P_8, or of P_8 - P_7, on [0, 1] as nodes 1 to 8; node 0 is the start. */
static void make_nodes(int radau) {
    node[0] = 0;
    for (int i = 1; i <= S; i++) {
        quad x = -cosq(M_PIq * (i - 0.25Q) / (S + 0.5Q));
        if (radau) x = i == S ? 1 : -cosq(M_PIq * (2 * i - 0.5Q) / (2 * S));
        for (int newton = 0; newton < 60; newton++) {
            quad p0 = 1, p1 = x, d0 = 0, d1 = 1;
            for (int n = 1; n < S; n++) {
                quad p2 = ((2 * n + 1) * x * p1 - n * p0) / (n + 1);
                quad d2 = d0 + (2 * n + 1) * p1;
                p0 = p1, p1 = p2, d0 = d1, d1 = d2;
            }
            x -= radau ? (p1 - p0) / (d1 - d0) : p1 / d1;
        }
        node[i] = (1 + x) / 2;
    }
}

/* Slopes at the nodes, and values at 1, of the polynomials that are 1 at one node and 0 at the others. */
static void make_rule(int radau) {
    make_nodes(radau);
    quad weight[P];
    for (int i = 0; i < P; i++) {
        weight[i] = 1;
        for (int j = 0; j < P; j++)
            if (j != i) weight[i] /= node[i] - node[j];
    }
    for (int i = 0; i < P; i++) {
        slope_of[i][i] = 0;
        for (int j = 0; j < P; j++)
            if (j != i) {
                slope_of[i][j] = weight[j] / weight[i] / (node[i] - node[j]);
                slope_of[i][i] -= slope_of[i][j];
            }
        last[i] = weight[i];
        for (int j = 0; j < P; j++)
            if (j != i) last[i] *= 1 - node[j];
    }
}

static quad a, b, mass, stiffness, force;

/* Newton's method for the changes at the nodes, its matrix in double precision; 0 if it fails. */
static int stages(const quad y[N], quad h, quad change[N][P]) {
    for (int iteration = 0; iteration < 40; iteration++) {
        static double matrix[U][U];
        quad defect[U];
        memset(matrix, 0, sizeof matrix);
        for (int i = 0; i < S; i++) {
            quad at[N], slope[N] = {0, 0, 0};
            for (int r = 0; r < N; r++) {
                at[r] = y[r] + change[r][i + 1];
                for (int j = 1; j < P; j++) slope[r] += slope_of[i + 1][j] * change[r][j];
                slope[r] /= h;
            }
            quad v = expq(at[X]), ageing = expq(-at[Y]);
            defect[N * i + Z] = slope[Z] - stiffness * (1 - v);
            defect[N * i + Y] = slope[Y] - (ageing - v);
            defect[N * i + X] = mass * v * slope[X] - (at[Z] - a * at[X] - b * at[Y]);
            for (int j = 0; j < S; j++) {
                double d = (double)(slope_of[i + 1][j + 1] / h);
                matrix[N * i + Z][N * j + Z] = d;
                matrix[N * i + Y][N * j + Y] = d;
                matrix[N * i + X][N * j + X] = (double)(mass * v) * d;
            }
            matrix[N * i + Z][N * i + X] += (double)(stiffness * v);
            matrix[N * i + Y][N * i + Y] += (double)ageing;
            matrix[N * i + Y][N * i + X] += (double)v;
            matrix[N * i + X][N * i + Z] -= 1;
            matrix[N * i + X][N * i + Y] += (double)b;
            matrix[N * i + X][N * i + X] += (double)(mass * v * slope[X] + a);
        }
        for (int c = 0; c < U; c++) {
            int pivot = c;
            double best = 0;
            for (int r = c; r < U; r++) {
                double largest = 0;
                for (int j = c; j < U; j++) largest = fmax(largest, fabs(matrix[r][j]));
                if (largest > 0 && fabs(matrix[r][c]) / largest > best) best = fabs(matrix[r][c]) / largest, pivot = r;
            }
            if (best == 0) return 0;
            for (int j = 0; j < U; j++) {
                double swap = matrix[c][j];
                matrix[c][j] = matrix[pivot][j], matrix[pivot][j] = swap;
            }
            quad swap = defect[c];
            defect[c] = defect[pivot], defect[pivot] = swap;
            for (int r = c + 1; r < U; r++) {
                double factor = matrix[r][c] / matrix[c][c];
                for (int j = c; j < U; j++) matrix[r][j] -= factor * matrix[c][j];
                defect[r] -= factor * defect[c];
            }
        }
        quad size = 0;
        for (int r = U - 1; r >= 0; r--) {
            for (int j = r + 1; j < U; j++) defect[r] -= matrix[r][j] * defect[j];
            defect[r] /= matrix[r][r];
            change[r % N][r / N + 1] -= defect[r];
            size = fmaxq(size, fabsq(defect[r]) / (r % N == Z ? force : 1));
        }
        if (!(size < 1e3)) return 0;
        if (size < 1e-28Q) return 1;
    }
    return 0;
}

static void end(const quad y[N], quad change[N][P], quad next[N]) {
    for (int r = 0; r < N; r++) {
        next[r] = y[r];
        for (int j = 1; j < P; j++) next[r] += last[j] * change[r][j];
    }
}

/* Size of the leading coefficient of the polynomial of a step. */
static quad leading(quad change[N][P]) {
    quad size = 0;
    for (int r = 0; r < N; r++) {
        quad sum = 0;
        for (int j = 1; j < P; j++) {
            quad part = change[r][j];
            for (int i = 0; i < P; i++)
                if (i != j) part /= node[j] - node[i];
            sum += part;
        }
        size = fmaxq(size, fabsq(sum) / (r == Z ? force : 1));
    }
    return size;
}

static quad pull(const quad y[N]) { return y[Z] - a * y[X] - b * y[Y]; }

static int integrate(quad t_end, quad x0, quad tolerance, quad result[N + 1]) {
    quad y[N] = {(quad)((double)(a - b) * (double)x0), -x0, x0}, t = 0, h = 1e-4Q;
    int steps = 0, found = 0;
    for (; t < t_end; steps++) {
        if (t + h > t_end) h = t_end - t;
        quad change[N][P] = {{0}}, next[N];
        quad size = stages(y, h, change) ? leading(change) : 1;
        quad factor = 0.9Q * powq(tolerance / fmaxq(size, 1e-30Q), 1.0Q / S);
        if (size > 2 * tolerance) {
            h *= fmaxq(0.2Q, fminq(factor, 0.8Q));
            continue;
        }
        end(y, change, next);
        if (!found && pull(y) > 0 && pull(next) <= 0 && next[X] > 0) {
            /* The peak: where the force that accelerates vanishes, by the rule of false position with halving. */
            quad low = 0, high = h, f_low = pull(y), f_high = pull(next), peak[N];
            for (int i = 0; i < 80 && high - low > 1e-22Q * h; i++) {
                quad part = low + (high - low) * f_low / (f_low - f_high);
                quad again[N][P] = {{0}};
                if (!stages(y, part, again)) return 0;
                end(y, again, peak);
                if (pull(peak) > 0) low = part, f_low = pull(peak), f_high /= 2;
                else high = part, f_high = pull(peak), f_low /= 2;
            }
            result[N] = peak[X];
            found = 1;
        }
        memcpy(y, next, sizeof y);
        t += h;
        h *= fmaxq(0.2Q, fminq(factor, 2));
    }
    memcpy(result, y, sizeof y);
    return steps;
}

int main(void) {
    double a_ = 0.005, b_ = 0.01, mass_ = 2.5e-16 * 3.2e6 * 3.2e6, x0 = -3.4657359027997265;
    double k[2] = {7.5e-3, 0.5 * (b_ - a_) * (1 + mass_ / a_)}, t_end[2] = {50.0 * (1.98357e-6 * 3.2e6), 940};
    a = a_, b = b_, mass = mass_, force = a;
    for (int c = 0; c < 2; c++) {
        quad before[N + 1] = {0};
        stiffness = k[c];
        for (int radau = 0; radau < 2; radau++)
            for (int fine = 0; fine < 2; fine++) {
                quad y[N + 1] = {0};
                make_rule(radau);
                int steps = integrate(t_end[c], x0, fine ? 1e-10Q : 1e-9Q, y);
                printf("%s %s %6d steps:", c ? "stick-slip" : "paper     ", radau ? "Radau" : "Gauss", steps);
                quad largest = 0;
                for (int r = 0; r <= N; r++) {
                    char digits[64];
                    quadmath_snprintf(digits, sizeof digits, "%.24Qe", y[r]);
                    printf(" %s", digits);
                    largest = fmaxq(largest, fabsq(y[r] - before[r]) / (r == Z ? force : 1));
                    before[r] = y[r];
                }
                printf("  (%.1e)\n", (double)largest);
                fflush(stdout);
            }
    }
}
