// Lane kernel: the statics of a robot on two flat feet, some postures abreast, in plain C++.
//
// The same work as one call of copsense's BatchKernel without gains: forward kinematics and centre
// of mass, wrenches, torques and CoPs of minimum wrench and minimum torque, each CoP's exact
// gradient projected on the admissible motions, margins, shares of the load, and the doubts that
// would send a posture to the reference. It is the floor that the kernel is measured against, so it
// knows at compile time what the kernel does not: how many joints there are, how they hang
// together, and that two soles carry the robot. `floor.py` writes that into robot.h. With
// -DUNKNOWN the same numbers are variables, as for a kernel that serves every robot.
//
// World axes, positions from the base's origin; a twist is (velocity, angular velocity), a wrench
// (force, moment). With h_i the first moment of body i and what it carries, joint i of axis a
// through p moves it by dh = a x (h - m p), feels -g . dh, and moves a foot by the screw
// s = (p x a, a). The first foot takes what the second leaves, b - y: tau = (G - D b) - B y with
// the 12 x 6 loop matrix B, and B = Q R serves the least squares, its adjoints and the tangents.

#include <cmath>
#include <cstring>

#include "robot.h"

#ifndef LANES
#ifdef __AVX512F__
#define LANES 8
#else
#define LANES 4
#endif
#endif

#define INLINE inline __attribute__((always_inline))

namespace {

typedef double Lanes __attribute__((vector_size(8 * LANES)));
typedef double Row __attribute__((vector_size(8 * LANES), aligned(8)));  // anywhere in an array
typedef long long Whole __attribute__((vector_size(8 * LANES)));

constexpr int NV = N + 6;
constexpr int UNKNOWNS = 6;
constexpr int OUTPUTS = 4;  // two coordinates of two CoPs
constexpr double ZERO[3] = {};
constexpr double LARGEST_ANGLE = 1e5, UNIT = 1e-6, HEIGHT = 0.5e-6, TILT = 0.5e-6;
constexpr double REPEAT = 1e-2, LOST = 1e-12, UNLOADED = 2e-9;

struct Vector {
    Lanes x, y, z;
};

struct Wrench {  // or a twist
    Vector force, moment;
};

struct Rotation {  // three columns
    Vector x, y, z;
};

// As in `copsense.batch.layout`.
struct Robot {
    double placement[N + 1][12], mass[N + 1], moment[N + 1][3];
    double carried[N + 1], gravity[3], level[2][3];
    double foot[2][12], plane[2][6], edges[EDGES][3], weight, arm;
};

struct Results {
    double *wrenches, *torques, *cops, *gradient, *margin, *share, *com;
    unsigned char *doubtful;
};

// What is known of the postures in hand.
struct Postures {
    Lanes q[NQ], doubt;
    Vector base;
    Rotation rotation[N + 1], foot_axes[2];
    Vector position[N + 1], first_moment[N + 1], rate[N + 1], foot[2];
    Wrench screw[N + 1];
    Vector weight[N + 1];
    Lanes gravity[N + 1];
    Lanes Q[UNKNOWNS][NS], R[UNKNOWNS][UNKNOWNS], T[UNKNOWNS][UNKNOWNS];
    Lanes C[6][NS], L[6][6];
    Lanes level[2][NV];
    Wrench load;
};

// What a criterion adds.
struct Answers {
    Wrench wrench[2], own[2];  // about the base's origin; in contact axes
    Lanes torque[N + 1], cop[2][2], gradient[OUTPUTS][NV], margin[2], share[2], doubt;
};

INLINE Lanes all(double number) { return number - Lanes{}; }
INLINE Lanes where(Whole mask, Lanes yes, Lanes no) { return mask ? yes : no; }
INLINE Lanes magnitude(Lanes a) { return where(a < 0.0, -a, a); }
INLINE bool any(Whole mask) {
    long long found = 0;
    for (int lane = 0; lane < LANES; lane++) found |= mask[lane];
    return found != 0;
}
INLINE Lanes root(Lanes a) {
    for (int lane = 0; lane < LANES; lane++) a[lane] = std::sqrt(a[lane]);
    return a;
}

INLINE Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
INLINE Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
INLINE Vector operator-(Vector a) { return {-a.x, -a.y, -a.z}; }
INLINE Vector operator*(Lanes s, Vector a) { return {s * a.x, s * a.y, s * a.z}; }
INLINE Vector operator*(double s, Vector a) { return {s * a.x, s * a.y, s * a.z}; }
INLINE Lanes dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
INLINE Vector cross(Vector a, Vector b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
INLINE Vector turned(const Rotation &R, const double *a) {
    return a[0] * R.x + a[1] * R.y + a[2] * R.z;
}
INLINE Vector along(const Rotation &R, Vector a) { return {dot(R.x, a), dot(R.y, a), dot(R.z, a)}; }
INLINE Vector constant(const double *a) { return {all(a[0]), all(a[1]), all(a[2])}; }

INLINE Wrench operator+(const Wrench &a, const Wrench &b) {
    return {a.force + b.force, a.moment + b.moment};
}
INLINE Lanes power(const Wrench &s, const Wrench &f) {
    return dot(s.force, f.force) + dot(s.moment, f.moment);
}
// How a wrench's power on a screw changes with the twist that carries the joint: s x* f.
INLINE Wrench carried(const Wrench &s, const Wrench &f) {
    return {cross(s.moment, f.force), cross(s.moment, f.moment) + cross(s.force, f.force)};
}

// Cephes' polynomials on |r| <= pi / 4, after Cody and Waite.
INLINE void sine_cosine(Lanes x, Lanes &sine, Lanes &cosine) {
    // The last bits of a sum with 1.5 * 2^52 are the quadrant.
    const Lanes shift = all(6755399441055744.0);
    Lanes sum = x * (2.0 / M_PI) + shift, n = sum - shift;
    Whole quadrant = (Whole)sum;
    Lanes r = x - n * 1.5707963109016418;
    r -= n * 1.5893254712295857e-08;
    r -= n * 6.123233995736766e-17;
    Lanes z = r * r;
    Lanes s = 1.58962301576546568060e-10 * z - 2.50507477628578072866e-8;
    s = s * z + 2.75573136213857245213e-6;
    s = s * z - 1.98412698295895385996e-4;
    s = s * z + 8.33333333332211858878e-3;
    s = s * z - 1.66666666666666307295e-1;
    s = r + r * z * s;
    Lanes c = -1.13585365213876817300e-11 * z + 2.08757008419747316778e-9;
    c = c * z - 2.75573141792967388112e-7;
    c = c * z + 2.48015872888517045348e-5;
    c = c * z - 1.38888888888730564116e-3;
    c = c * z + 4.16666666666665929218e-2;
    c = 1.0 - 0.5 * z + z * z * c;
    Whole odd = (quadrant & 1) != 0;
    Lanes a = where(odd, c, s), b = where(odd, s, c);
    sine = (Lanes)((Whole)a ^ ((quadrant & 2) << 62));
    cosine = (Lanes)((Whole)b ^ (((quadrant + 1) & 2) << 62));
}

void place_base(const Robot &robot, Postures &at) {
    Lanes x = at.q[3], y = at.q[4], z = at.q[5], w = at.q[6];
    Lanes square = x * x + y * y + z * z + w * w, two = 2.0 / square;
    Vector columns[3] = {
        {1.0 - two * (y * y + z * z), two * (x * y + z * w), two * (x * z - y * w)},
        {two * (x * y - z * w), 1.0 - two * (x * x + z * z), two * (y * z + x * w)},
        {two * (x * z + y * w), two * (y * z - x * w), 1.0 - two * (x * x + y * y)},
    };
    const double *t = robot.placement[0];
    Vector rows[3] = {{all(t[0]), all(t[3]), all(t[6])},
                      {all(t[1]), all(t[4]), all(t[7])},
                      {all(t[2]), all(t[5]), all(t[8])}};
    auto rooted = [&](Vector a) {
        return Vector{dot(rows[0], a), dot(rows[1], a), dot(rows[2], a)};
    };
    at.rotation[0] = {rooted(columns[0]), rooted(columns[1]), rooted(columns[2])};
    at.position[0] = {all(0), all(0), all(0)};
    at.base = rooted({at.q[0], at.q[1], at.q[2]}) + constant(t + 9);
    at.doubt = where(magnitude(square - 1.0) < UNIT, all(0), all(1));
}

void move(const Robot &robot, Postures &at) {
    place_base(robot, at);
    Lanes largest = all(0);
    for (int i = 1; i <= JOINTS; i++) {
        const Rotation &up = at.rotation[PARENT[i]];
        const double *t = robot.placement[i];
        at.position[i] = at.position[PARENT[i]] + turned(up, t + 9);
        Vector x = turned(up, t), y = turned(up, t + 3);
        Lanes q = at.q[COLUMN[i]], s, c;
        sine_cosine(q, s, c);
        largest = where(largest < magnitude(q), magnitude(q), largest);
        at.rotation[i] = {c * x + s * y, c * y - s * x, turned(up, t + 6)};
    }
    at.doubt = where(largest < LARGEST_ANGLE, at.doubt, all(1));
    for (int i = 0; i <= JOINTS; i++)
        at.first_moment[i] =
            robot.mass[i] * at.position[i] + turned(at.rotation[i], robot.moment[i]);
    Vector g = constant(robot.gravity);
    for (int i = JOINTS; i > 0; i--) {
        Vector h = at.first_moment[i], a = at.rotation[i].z, p = at.position[i];
        at.first_moment[PARENT[i]] = at.first_moment[PARENT[i]] + h;
        at.rate[i] = cross(a, h - robot.carried[i] * p);
        at.screw[i] = {cross(p, a), a};
        at.weight[i] = cross(at.rate[i], g);
        at.gravity[i] = -dot(at.rate[i], g);
    }
    at.load = {-robot.carried[0] * g, cross(g, at.first_moment[0])};
}

void place_feet(const Robot &robot, Postures &at) {
    for (int k = 0; k < 2; k++) {
        const Rotation &up = at.rotation[FOOT[k]];
        const double *t = robot.foot[k], *plane = robot.plane[k];
        at.foot[k] = at.position[FOOT[k]] + turned(up, t + 9);
        at.foot_axes[k] = {turned(up, t), turned(up, t + 3), turned(up, t + 6)};
        if (plane[0] == 0 && plane[1] == 0 && plane[2] == 0) continue;  // none is stated
        Vector n = constant(plane), z = at.foot_axes[k].z - n;
        Lanes height = magnitude(dot(at.base + at.foot[k] - constant(plane + 3), n));
        Lanes tilt = magnitude(z.x) + magnitude(z.y) + magnitude(z.z);
        at.doubt = where(height < HEIGHT, at.doubt, all(1));
        at.doubt = where(tilt < TILT, at.doubt, all(1));
    }
}

INLINE Lanes product(const Lanes *a, const Lanes *b) {
    Lanes s = a[0] * b[0];
    for (int t = 1; t < SUPPORT; t++) s += a[t] * b[t];
    return s;
}

INLINE Lanes take_off(Lanes *a, const Lanes *q, Lanes share) {
    Lanes c = product(q, a) * share;
    for (int t = 0; t < SUPPORT; t++) a[t] -= c * q[t];
    return c;
}

// B = Q R by modified Gram-Schmidt and T = R^-1.
void build(Postures &at) {
    for (int t = 0; t < SUPPORT; t++) {
        const Wrench &s = at.screw[SUPPORTS[t]];
        Lanes row[6] = {s.force.x, s.force.y, s.force.z, s.moment.x, s.moment.y, s.moment.z};
        for (int j = 0; j < 6; j++) at.Q[j][t] = SIDE[t] == 0 ? -row[j] : row[j];
    }
    auto &Q = at.Q;
    auto &R = at.R;
    auto &T = at.T;
    Lanes lost = all(0);
    for (int j = 0; j < 6; j++) R[j][j] = product(Q[j], Q[j]);
    for (int j = 0; j < 6; j++) {
        Lanes before = R[j][j], after = product(Q[j], Q[j]);
        Whole shrunk = after < before * REPEAT;
        if (any(shrunk)) {
            Lanes share = where(shrunk, all(1), all(0));
            for (int k = 0; k < j; k++) R[k][j] += take_off(Q[j], Q[k], share);
            after = product(Q[j], Q[j]);
        }
        lost = where(before * LOST < after, lost, all(1));
        R[j][j] = root(after);
        Lanes inverse = 1.0 / R[j][j];
        for (int t = 0; t < SUPPORT; t++) Q[j][t] *= inverse;
        for (int k = j + 1; k < 6; k++) R[j][k] = take_off(Q[k], Q[j], all(1));
        T[j][j] = inverse;
    }
    at.doubt = where(lost < 0.5, at.doubt, all(1));
    for (int j = 1; j < 6; j++)
        for (int i = 0; i < j; i++) {
            Lanes s = T[i][i] * R[i][j];
            for (int k = i + 1; k < j; k++) s += T[i][k] * R[k][j];
            T[i][j] = -(s * T[j][j]);
        }
}

// g -= Q Q' g.
INLINE void remove(const Postures &at, Lanes *g) {
    Lanes c[UNKNOWNS];
    for (int k = 0; k < UNKNOWNS; k++) c[k] = product(at.Q[k], g);
    for (int t = 0; t < SUPPORT; t++)
        for (int k = 0; k < UNKNOWNS; k++) g[t] -= c[k] * at.Q[k][t];
}

// C = (1 - Q Q') D, and the inverse of the Cholesky factor of 1 + C'C.
void span(Postures &at) {
    auto &C = at.C;
    auto &L = at.L;
    for (int t = 0; t < SUPPORT; t++) {
        const Wrench &s = at.screw[SUPPORTS[t]];
        Lanes row[6] = {s.force.x, s.force.y, s.force.z, s.moment.x, s.moment.y, s.moment.z};
        for (int j = 0; j < 6; j++) C[j][t] = SIDE[t] == 0 ? row[j] : all(0);
    }
    for (int j = 0; j < 6; j++) remove(at, C[j]);
    for (int i = 0; i < 6; i++)
        for (int j = 0; j <= i; j++) {
            Lanes s = product(C[i], C[j]) + (i == j ? 1.0 : 0.0);
            for (int k = 0; k < j; k++) s -= L[i][k] * L[j][k];
            L[i][j] = i == j ? 1.0 / root(s) : s * L[j][j];
        }
    for (int i = 1; i < 6; i++)
        for (int j = 0; j < i; j++) {
            Lanes s = L[i][j] * L[j][j];
            for (int k = j + 1; k < i; k++) s += L[i][k] * L[k][j];
            L[i][j] = -(s * L[i][i]);
        }
}

// Project a gradient whose part on the support joints is in `felt`.
void project(const Postures &at, Lanes *gradient, Lanes *felt) {
    remove(at, felt);
    Lanes y[6], z[6];
    for (int i = 0; i < 6; i++) y[i] = gradient[i] + product(at.C[i], felt);
    for (int i = 0; i < 6; i++) {
        z[i] = at.L[i][0] * y[0];
        for (int k = 1; k <= i; k++) z[i] += at.L[i][k] * y[k];
    }
    for (int i = 0; i < 6; i++) {
        y[i] = at.L[i][i] * z[i];
        for (int k = i + 1; k < 6; k++) y[i] += at.L[k][i] * z[k];
        gradient[i] -= y[i];
    }
    for (int t = 0; t < SUPPORT; t++) {
        Lanes s = felt[t];
        for (int i = 0; i < 6; i++) s -= y[i] * at.C[i][t];
        gradient[5 + SUPPORTS[t]] = s;
    }
}

INLINE void put(Lanes *at, Vector a) { at[0] = a.x, at[1] = a.y, at[2] = a.z; }
INLINE Vector got(const Lanes *at) { return {at[0], at[1], at[2]}; }

// Gradients of the centre of mass along the two level directions, times the mass, projected.
void level_gradients(const Robot &robot, Postures &at) {
    for (int j = 0; j < 2; j++) {
        Vector u = constant(robot.level[j]);
        Lanes *gradient = at.level[j], felt[NS];
        put(gradient, robot.carried[0] * u);
        put(gradient + 3, cross(at.first_moment[0], u));
        for (int i = 1; i <= JOINTS; i++) gradient[5 + i] = dot(at.rate[i], u);
        for (int t = 0; t < SUPPORT; t++) felt[t] = gradient[5 + SUPPORTS[t]];
        project(at, gradient, felt);
    }
}

// Torques, wrenches in contact axes, CoPs, margins and shares of the load.
void finish(const Robot &robot, const Postures &at, Answers &found) {
    found.doubt = at.doubt;
    for (int i = 1; i <= JOINTS; i++) found.torque[i] = at.gravity[i];
    for (int t = 0; t < SUPPORT; t++) {
        int i = SUPPORTS[t];
        found.torque[i] = at.gravity[i] - power(at.screw[i], found.wrench[SIDE[t]]);
    }
    for (int k = 0; k < 2; k++) {
        const Wrench &f = found.wrench[k];
        Wrench &own = found.own[k];
        own.force = along(at.foot_axes[k], f.force);
        own.moment = along(at.foot_axes[k], f.moment - cross(at.foot[k], f.force));
        Lanes share = 1.0 / own.force.z, *cop = found.cop[k];
        cop[0] = -(own.moment.y * share);
        cop[1] = own.moment.x * share;
        found.doubt =
            where(UNLOADED * robot.weight < magnitude(own.force.z), found.doubt, all(1));
        Lanes least = all(INFINITY);
        for (int e = FIRST_EDGE[k]; e < FIRST_EDGE[k + 1]; e++) {
            const double *edge = robot.edges[e];
            Lanes margin = edge[2] - (edge[0] * cop[0] + edge[1] * cop[1]);
            least = where(margin < least, margin, least);
        }
        found.margin[k] = least;
        found.share[k] = own.force.z * (1.0 / robot.weight);
    }
}

void minimum_wrench(const Robot &robot, const Postures &at, Answers &found) {
    Vector c = 0.5 * (at.foot[0] + at.foot[1]), F = at.load.force;
    double arm = robot.arm;
    Lanes xx = all(2 * arm), yy = xx, zz = xx, xy = all(0), xz = xy, yz = xy;
    for (int k = 0; k < 2; k++) {
        Vector r = at.foot[k] - c;
        xx += r.y * r.y + r.z * r.z, yy += r.x * r.x + r.z * r.z, zz += r.x * r.x + r.y * r.y;
        xy -= r.x * r.y, xz -= r.x * r.z, yz -= r.y * r.z;
    }
    Rotation I = {{yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy}, {}, {}};
    Lanes s = 1.0 / (xx * I.x.x + xy * I.x.y + xz * I.x.z);
    I.x = s * I.x;
    I.y = {I.x.y, s * (xx * zz - xz * xz), s * (xy * xz - xx * yz)};
    I.z = {I.x.z, I.y.z, s * (xx * yy - xy * xy)};
    Vector alpha = along(I, at.load.moment - cross(c, F));
    for (int k = 0; k < 2; k++) {
        Vector f = 0.5 * F + cross(alpha, at.foot[k] - c);
        found.wrench[k] = {f, cross(at.foot[k], f) + arm * alpha};
    }
    finish(robot, at, found);
    Vector g = constant(robot.gravity), first = constant(robot.level[0]);
    Vector second = constant(robot.level[1]);
    for (int k = 0; k < 2; k++) {
        const Rotation &axes = at.foot_axes[k];
        Vector lean = cross(at.foot[k] - c, axes.z);
        Lanes share = 1.0 / found.own[k].force.z;
        for (int output = 0; output < 2; output++) {
            Vector own = output == 0 ? -arm * axes.y : arm * axes.x;
            Vector v = share * (own - found.cop[k][output] * lean);
            Vector u = cross(along(I, v), g);
            Lanes a = dot(u, first), b = dot(u, second);
            Lanes *gradient = found.gradient[2 * k + output];
            for (int i = 0; i < JOINTS + 6; i++)
                gradient[i] = a * at.level[0][i] + b * at.level[1][i];
        }
    }
}

// What one output's gradient needs of the torques, the same for every output.
struct Sweep {
    Wrench arm[NS];      // A = [0; dh x g] + s x* phi
    Wrench turn[NS];     // K = s x (the twist that the torques, as rates, give the foot below)
    Wrench foot_rate[2];  // that twist with all joints of a leg
};

void prepare(const Postures &at, const Answers &found, Sweep &of) {
    of.foot_rate[0] = of.foot_rate[1] = {constant(ZERO), constant(ZERO)};
    for (int t = SUPPORT - 1; t >= 0; t--) {
        int i = SUPPORTS[t];
        const Wrench &s = at.screw[i];
        Wrench &below = of.foot_rate[SIDE[t]];
        Vector v = below.force, w = below.moment;
        of.turn[t] = {cross(s.force, w) + cross(s.moment, v), cross(s.moment, w)};
        below = {v + found.torque[i] * s.force, w + found.torque[i] * s.moment};
        of.arm[t] = carried(s, found.wrench[SIDE[t]]);
        of.arm[t].moment = of.arm[t].moment + at.weight[i];
    }
}

// One output's gradient under minimum torque: the adjoint, and one sweep out and one back.
void sweep(const Robot &robot, const Postures &at, Answers &found, const Sweep &of, int k,
           int output) {
    const Rotation &axes = at.foot_axes[k];
    Lanes share = 1.0 / found.own[k].force.z;
    Vector w = output == 0 ? -share * axes.y : share * axes.x;
    Vector v = cross(at.foot[k], w) - (found.cop[k][output] * share) * axes.z;
    // mu = N z with R'R z = -N' l, on the second foot and its opposite on the first.
    Lanes x[6], y[6], z[6];
    put(x, k == 0 ? v : -v);
    put(x + 3, k == 0 ? w : -w);
    for (int i = 0; i < 6; i++) {
        y[i] = at.T[i][i] * x[i];
        for (int j = 0; j < i; j++) y[i] += at.T[j][i] * x[j];
    }
    for (int i = 0; i < 6; i++) {
        z[i] = at.T[i][i] * y[i];
        for (int j = i + 1; j < 6; j++) z[i] += at.T[i][j] * y[j];
    }
    Wrench mu[2] = {{-got(z), -got(z + 3)}, {got(z), got(z + 3)}};
    Lanes rate[NS];
    Vector twist = k == 0 ? w : 0.0 * w;
    for (int t = 0; t < SUPPORT; t++) {
        const Wrench &s = at.screw[SUPPORTS[t]];
        rate[t] = -power(s, mu[SIDE[t]]);
        if (SIDE[t] == 0) twist = twist - rate[t] * s.moment;
    }
    Vector u = cross(twist, constant(robot.gravity));
    Lanes *gradient = found.gradient[2 * k + output], felt[NS];
    Wrench pull[2] = {carried(of.foot_rate[0], mu[0]), carried(of.foot_rate[1], mu[1])};
    Wrench base = {robot.carried[0] * u - pull[0].force - pull[1].force,
                   cross(at.first_moment[0], u) - pull[0].moment - pull[1].moment};
    Vector turning[NS];
    for (int t = 0; t < SUPPORT; t++) {
        int i = SUPPORTS[t], up = ANCHOR[i];
        Vector omega = up >= 0 ? turning[up] : twist;
        felt[t] = -dot(omega, at.weight[i]) - power(of.turn[t], mu[SIDE[t]]);
        turning[t] = omega + rate[t] * at.screw[i].moment;
    }
    pull[0] = pull[1] = {constant(ZERO), constant(ZERO)};
    for (int t = SUPPORT - 1; t >= 0; t--) {
        Wrench &sum = pull[SIDE[t]];
        sum = {sum.force + rate[t] * of.arm[t].force, sum.moment + rate[t] * of.arm[t].moment};
        felt[t] -= power(at.screw[SUPPORTS[t]], sum);
    }
    put(gradient, base.force - pull[0].force - pull[1].force);
    put(gradient + 3, base.moment - pull[0].moment - pull[1].moment);
    for (int e = 0; e < JOINTS - SUPPORT; e++) {
        int i = REST[e], up = ANCHOR[i];
        gradient[5 + i] = -dot(up >= 0 ? turning[up] : twist, at.weight[i]);
    }
    project(at, gradient, felt);
}

void minimum_torque(const Robot &robot, const Postures &at, Answers &found) {
    Lanes tau[NS], x[6], y[6];
    for (int t = 0; t < SUPPORT; t++) {
        int i = SUPPORTS[t];
        tau[t] = SIDE[t] == 0 ? at.gravity[i] - power(at.screw[i], at.load) : at.gravity[i];
    }
    for (int k = 0; k < 6; k++) x[k] = product(at.Q[k], tau);
    for (int i = 0; i < 6; i++) {
        y[i] = at.T[i][i] * x[i];
        for (int j = i + 1; j < 6; j++) y[i] += at.T[i][j] * x[j];
    }
    found.wrench[1] = {got(y), got(y + 3)};
    found.wrench[0] = {at.load.force - found.wrench[1].force,
                       at.load.moment - found.wrench[1].moment};
    finish(robot, at, found);
    Sweep of;
    prepare(at, found, of);
    for (int output = 0; output < OUTPUTS; output++)
        sweep(robot, at, found, of, output / 2, output % 2);
}

// The columns of a square of lanes: halves are exchanged at distance 1, 2, 4.
template <int distance>
INLINE void exchange(Lanes *rows) {
    Whole low, high;
    for (int p = 0; p < LANES; p++) {
        low[p] = p & distance ? LANES + p - distance : p;
        high[p] = p & distance ? LANES + p : p + distance;
    }
    for (int i = 0; i < LANES; i++)
        if (!(i & distance)) {
            Lanes a = rows[i], b = rows[i + distance];
            rows[i] = __builtin_shuffle(a, b, low);
            rows[i + distance] = __builtin_shuffle(a, b, high);
        }
}

INLINE void transpose(Lanes *rows) {
    exchange<1>(rows);
    exchange<2>(rows);
    if constexpr (LANES == 8) exchange<4>(rows);
}

// n rows of lanes from n numbers of each posture, the last one repeated where there are too few.
INLINE void read(Lanes *rows, const double *values, int n, int count) {
    for (int block = 0; block < n; block += LANES) {
        int first = block < n - LANES ? block : n - LANES;
        Lanes square[LANES];
        for (int lane = 0; lane < LANES; lane++)
            square[lane] = *(const Row *)(values + n * (lane < count ? lane : count - 1) + first);
        transpose(square);
        for (int i = 0; i < LANES; i++) rows[first + i] = square[i];
    }
}

// n rows of lanes into n numbers of each posture, which are `stride` apart.
INLINE void write(const Lanes *rows, double *values, int n, int stride, int count) {
    if (n < LANES || count < LANES) {
        for (int lane = 0; lane < count; lane++)
            for (int i = 0; i < n; i++) values[stride * lane + i] = rows[i][lane];
        return;
    }
    for (int block = 0; block < n; block += LANES) {
        int first = block < n - LANES ? block : n - LANES;
        Lanes square[LANES];
        for (int i = 0; i < LANES; i++) square[i] = rows[first + i];
        transpose(square);
        for (int lane = 0; lane < LANES; lane++)
            *(Row *)(values + stride * lane + first) = square[lane];
    }
}

void hand_over(const Postures &at, Answers &found, const Results &out, long first, int count,
               int column) {
    for (int output = 0; output < OUTPUTS; output++) {
        Lanes *gradient = found.gradient[output];  // the base's part in the base's own axes
        put(gradient, along(at.rotation[0], got(gradient)));
        put(gradient + 3, along(at.rotation[0], got(gradient + 3)));
    }
    long row = 2 * first + column;
    write(&found.own[0].force.x, out.wrenches + 12 * row, 12, 24, count);
    write(found.torque + 1, out.torques + JOINTS * row, JOINTS, 2 * JOINTS, count);
    write(found.cop[0], out.cops + 4 * row, 4, 8, count);
    constexpr int GRADIENT = OUTPUTS * NV;
    write(found.gradient[0], out.gradient + GRADIENT * row, GRADIENT, 2 * GRADIENT, count);
    write(found.margin, out.margin + 2 * row, 2, 4, count);
    write(found.share, out.share + 2 * row, 2, 4, count);
    for (int lane = 0; lane < count; lane++)
        out.doubtful[row + 2 * lane] = found.doubt[lane] != 0.0;
}

}  // namespace

extern "C" int lanes() { return LANES; }

extern "C" void evaluate(const Robot *given, const Results *out, const double *q, long count) {
    const Robot &robot = *given;
    static Postures at;
    static Answers found;
    for (long first = 0; first < count; first += LANES) {
        int some = count - first < LANES ? count - first : LANES;
        read(at.q, q + NQ * first, NQ, some);
        move(robot, at);
        place_feet(robot, at);
        build(at);
        span(at);
        level_gradients(robot, at);
        minimum_wrench(robot, at, found);
        hand_over(at, found, *out, first, some, 0);
        minimum_torque(robot, at, found);
        hand_over(at, found, *out, first, some, 1);
        Vector com = at.base + (1.0 / robot.carried[0]) * at.first_moment[0];
        write(&com.x, out->com + 3 * first, 3, 3, some);
    }
}
