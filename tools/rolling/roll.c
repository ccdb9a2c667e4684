/* One sphere that rolls and hops over fixed spheres: the solver of tools/rolling.py, which compiles it.

   Units: the diameter of the sphere, g' = (1 - 1/s) g, and the mass of the sphere. The velocity of the
   sphere v, its spin w and the contacts obey
     (1 + 1/2s) dv/dt = 18 nu/s F(Re) (U(z) - v) + gravity + contacts,   1/10 dw/dt = moments of friction.
   A contact is rigid, with Coulomb's friction: its impulse of a time step is the least that keeps the
   spheres apart at the end of the step. So a sphere that meets the bed does not rebound, unless there is
   a restitution. */

#include <math.h>
#include <stdlib.h>

enum { NEAR = 400, MOST_CONTACTS = 40, SWEEPS = 8 };

static const double WAY_OF_STEP = 0.02;  /* longest way of a time step near the bed, and in the air: */
static const double WAY_IN_AIR = 0.1;
static const double MARGIN = 0.3;        /* grains within this of a contact are listed */
static const double INERTIA = 0.1;

typedef struct {
    /* the bed: x, y, z and diameter of each grain, its periodic length and width, its largest diameter */
    const double *bed;
    int grains;
    double length, width, size;
    /* the fluid: s, nu; slope: gravity along and normal to the bed */
    double ratio, viscosity, along, normal;
    /* speed of the fluid at heights over the zero level: at `fine` apart below `knee`, then at `coarse` */
    double fine, coarse;
    int fine_count, coarse_count;
    /* depth of the flow over the zero level */
    double depth;
    double friction, restitution;
    double time_step;                    /* longest time step */
    double look;                         /* time between two looks */
    double longest;                      /* time after which a sphere counts as one that stops */
    double gust_time;                    /* how long a gust lasts at most */
    int always;                          /* whether also one that has not come the first way is in the mean flow */
    /* the bed's columns of 1 by 1, each with the places of its grains in `of_column` */
    int columns, rows;
    const int *first_of_column, *of_column;
} Scene;

typedef struct {
    double at[3], v[3], w[3];
    double near[NEAR][4];                /* centres of the grains near it, and how far it touches each */
    int count;
    double listed[3];                    /* where it was when the list was made */
    double reynolds, factor;             /* the drag is renewed where Re has changed by 2 % */
} Sphere;

static double wrapped(double x, double side) { return x - side * floor(x / side + 0.5); }

static int turned(int place, int count) { return ((place % count) + count) % count; }

static void list_near(const Scene *s, Sphere *p)
{
    double reach = (1 + s->size) / 2 + MARGIN;
    int far = (int)ceil(reach);
    int column = (int)floor(p->at[0] * s->columns / s->length);
    int row = (int)floor(p->at[1] * s->rows / s->width);
    p->count = 0;
    for (int i = column - far; i <= column + far; i++)
        for (int j = row - far; j <= row + far; j++) {
            int cell = turned(i, s->columns) * s->rows + turned(j, s->rows);
            for (int k = s->first_of_column[cell]; k < s->first_of_column[cell + 1]; k++) {
                const double *b = s->bed + 4 * s->of_column[k];
                double z = p->at[2] - b[2];
                if (z > reach || z < -reach) continue;
                double x = wrapped(p->at[0] - b[0], s->length);
                double y = wrapped(p->at[1] - b[1], s->width);
                if (x * x + y * y + z * z > reach * reach || p->count == NEAR) continue;
                double *image = p->near[p->count++];
                image[0] = p->at[0] - x;
                image[1] = p->at[1] - y;
                image[2] = b[2];
                image[3] = (1 + b[3]) / 2;
            }
        }
    for (int i = 0; i < 3; i++) p->listed[i] = p->at[i];
}

static double drag_factor(double re)     /* Clift and Gauvin */
{
    if (re < 1e-12) return 1;
    return 1 + 0.15 * pow(re, 0.687) + 0.0175 * re / (1 + 42500 * pow(re, -1.16));
}

static double speed_at(const Scene *s, const double *flow, double z)
{
    if (z <= 0) return 0;
    double knee = s->fine * (s->fine_count - 1);
    const double *table = flow;
    double place = z / s->fine;
    int last = s->fine_count - 2;
    if (z >= knee) {
        table = flow + s->fine_count;
        place = (z - knee) / s->coarse;
        last = s->coarse_count - 2;
    }
    int i = (int)fmin(place, last);
    double part = fmin(place - i, 1);
    return table[i] + part * (table[i + 1] - table[i]);
}

/* The step of the motion by drag and gravity alone, exact for a drag that is constant in it. */
static void pull(const Scene *s, Sphere *p, const double *flow, double level, double dt)
{
    double area = 1, weight = 1, middle = p->at[2] - level;
    double covered = s->depth - middle;
    if (covered < 0.5) {                 /* it stands out of the water */
        double top = fmax(covered, -0.5), up = 2 * top;
        area = fmax((acos(-up) + up * sqrt(fmax(1 - up * up, 0))) / M_PI, 1e-9);
        double volume = (2 + 3 * up - up * up * up) / 4;
        weight = volume + (1 - volume) * s->ratio / (s->ratio - 1);
        middle += (top - 0.5) / 2;
    }
    double u = speed_at(s, flow, middle);
    double x = u - p->v[0];
    double re = sqrt(x * x + p->v[1] * p->v[1] + p->v[2] * p->v[2]) / s->viscosity;
    if (fabs(re - p->reynolds) > 0.02 * p->reynolds) {
        p->reynolds = re;
        p->factor = drag_factor(re);
    }
    double mass = 1 + 0.5 / s->ratio;
    double k = 18 * s->viscosity / s->ratio * area * p->factor / mass;
    double left = exp(-k * dt), end[3];
    end[0] = u + weight * s->along / mass / k;
    end[1] = 0;
    end[2] = weight * s->normal / mass / k;
    for (int i = 0; i < 3; i++) p->v[i] = end[i] + (p->v[i] - end[i]) * left;
}

/* The impulses of the contacts of a time step, found one after the other until they agree. */
static void contacts(const Scene *s, Sphere *p, double dt)
{
    double n[MOST_CONTACTS][3], least[MOST_CONTACTS], push[MOST_CONTACTS], rub[MOST_CONTACTS][3];
    double mass = 1 + 0.5 / s->ratio;
    double speed = sqrt(p->v[0] * p->v[0] + p->v[1] * p->v[1] + p->v[2] * p->v[2]);
    double further = 2 * speed * dt;
    int count = 0;
    for (int c = 0; c < p->count && count < MOST_CONTACTS; c++) {
        double x = p->at[0] - p->near[c][0], y = p->at[1] - p->near[c][1], z = p->at[2] - p->near[c][2];
        double square = x * x + y * y + z * z;
        double touch = p->near[c][3], reach = touch + further;
        if (square > reach * reach) continue;
        double apart = sqrt(square), gap = apart - touch;
        double *m = n[count];
        m[0] = x / apart;
        m[1] = y / apart;
        m[2] = z / apart;
        double vn = p->v[0] * m[0] + p->v[1] * m[1] + p->v[2] * m[2];
        int meets = gap + vn * dt < 0;
        least[count] = meets ? fmax(-fmax(gap, 0) / dt, -s->restitution * vn) : -gap / dt;
        for (int i = 0; i < 3; i++) rub[count][i] = 0;
        push[count++] = 0;
    }
    for (int sweep = 0; sweep < SWEEPS && count; sweep++) {
        double changed = 0;
        for (int c = 0; c < count; c++) {
            double *m = n[c];
            double vn = p->v[0] * m[0] + p->v[1] * m[1] + p->v[2] * m[2];
            double now = fmax(push[c] + mass * (least[c] - vn), 0);
            double more = now - push[c];
            push[c] = now;
            changed = fmax(changed, fabs(more));
            for (int i = 0; i < 3; i++) p->v[i] += more / mass * m[i];
            if (now == 0 && rub[c][0] == 0 && rub[c][1] == 0 && rub[c][2] == 0) continue;
            /* the slip where they touch, -n/2 from the centre */
            double slip[3] = {p->v[0] - (p->w[1] * m[2] - p->w[2] * m[1]) / 2,
                              p->v[1] - (p->w[2] * m[0] - p->w[0] * m[2]) / 2,
                              p->v[2] - (p->w[0] * m[1] - p->w[1] * m[0]) / 2};
            double off = slip[0] * m[0] + slip[1] * m[1] + slip[2] * m[2];
            double next[3], size = 0;
            for (int i = 0; i < 3; i++) {
                next[i] = rub[c][i] - (slip[i] - off * m[i]) / (1 / mass + 0.25 / INERTIA);
                size += next[i] * next[i];
            }
            size = sqrt(size);
            double held = size > s->friction * now ? s->friction * now / size : 1;
            double turn[3];
            for (int i = 0; i < 3; i++) {
                next[i] *= held;
                turn[i] = next[i] - rub[c][i];
                rub[c][i] = next[i];
                p->v[i] += turn[i] / mass;
                changed = fmax(changed, fabs(turn[i]));
            }
            p->w[0] -= (m[1] * turn[2] - m[2] * turn[1]) / 2 / INERTIA;
            p->w[1] -= (m[2] * turn[0] - m[0] * turn[2]) / 2 / INERTIA;
            p->w[2] -= (m[0] * turn[1] - m[1] * turn[0]) / 2 / INERTIA;
        }
        if (changed < 1e-6) break;
    }
}

static void apart(Sphere *p)             /* takes away what overlap the steps have left */
{
    for (int c = 0; c < p->count; c++) {
        double *b = p->near[c], touch = b[3];
        double x = p->at[0] - b[0], y = p->at[1] - b[1], z = p->at[2] - b[2];
        double square = x * x + y * y + z * z;
        if (square >= touch * touch) continue;
        double push = (touch / sqrt(square) - 1) / 2;
        p->at[0] += push * x;
        p->at[1] += push * y;
        p->at[2] += push * z;
    }
}

/* Follows a sphere until it has come `way` downstream, or stops, or for `longest`; returns how far it has come at most. */
static double follow(const Scene *s, Sphere *p, const double *flow, double level, double way, double longest)
{
    double start = p->at[0], most = 0, clock = 0, next_look = s->look, last[3];
    for (int i = 0; i < 3; i++) last[i] = p->at[i];
    p->reynolds = -1;
    while (clock < longest) {
        double far = 0;
        for (int i = 0; i < 3; i++) far = fmax(far, fabs(p->at[i] - p->listed[i]));
        if (far > MARGIN / 2) list_near(s, p);
        double speed = sqrt(p->v[0] * p->v[0] + p->v[1] * p->v[1] + p->v[2] * p->v[2]);
        double step = p->count ? WAY_OF_STEP : WAY_IN_AIR;
        double dt = fmin(s->time_step, step / (speed + 1e-12));
        pull(s, p, flow, level, dt);
        if (p->count) contacts(s, p, dt);
        for (int i = 0; i < 3; i++) p->at[i] += p->v[i] * dt;
        if (p->count) apart(p);
        clock += dt;
        most = fmax(most, p->at[0] - start);
        if (most >= way) return most;
        if (clock >= next_look) {
            double moved = 0;
            for (int i = 0; i < 3; i++) {
                moved = fmax(moved, fabs(p->at[i] - last[i]));
                last[i] = p->at[i];
            }
            if (moved < 0.01) return most;
            next_look = clock + s->look;
        }
    }
    return most;
}

/* Lays spheres on the bed at (x, y), at rest; each comes `first` in the gust, then up to `then` in the
   mean flow. `settle`: it first comes to rest in a still fluid. Writes how far each came in both. */
int roll(const Scene *s, int count, const double *places, int settle, const double *still,
         const double *gust, double gust_level, const double *mean, double mean_level,
         double first, double then, double *in_gust, double *after)
{
    for (int probe = 0; probe < count; probe++) {
        Sphere p = {.at = {places[2 * probe], places[2 * probe + 1], -1e9}};
        for (int g = 0; g < s->grains; g++) {
            const double *b = s->bed + 4 * g;
            double reach = (1 + b[3]) / 2;
            double x = wrapped(p.at[0] - b[0], s->length), y = wrapped(p.at[1] - b[1], s->width);
            double room = reach * reach - x * x - y * y;
            if (room > 0) p.at[2] = fmax(p.at[2], b[2] + sqrt(room));
        }
        list_near(s, &p);
        if (settle) follow(s, &p, still, gust_level, 1e9, s->longest);
        in_gust[probe] = follow(s, &p, gust, gust_level, first, fmin(s->gust_time, s->longest));
        after[probe] = 0;
        int goes_on = s->always || in_gust[probe] >= first;
        if (goes_on && then > 0) after[probe] = follow(s, &p, mean, mean_level, then, s->longest);
    }
    return 0;
}
