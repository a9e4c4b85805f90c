/* Rays against the triangles of a vshi_triangles. */
#include "trace/embree_scene.h"

#include <float.h>
#include <string.h>

/* Share of the casters' size by which rays begin off a surface: 64 times a float's rounding of their
 * positions. */
static const double OFFSET = 0x1p-18;

static const double COHERENT = 0.9; /* least cosine between a packet's rays */

/* Rays traced at a time if the machine has vectors so wide; else twice half as many. On the cloister, towards
 * a sun of 5°, a ray takes 36 ns alone, 15 in packets of eight and 9.5 in packets of sixteen; on lobes of
 * 50,000 triangles 55, 38 and 28. */
enum { PACKET = 16 };

/* A ray that begins farther than this from the scene's centre is moved up to the scene, whose half size is at
 * most 1. */
#define FAR_ORIGIN 4.0

/* How Embree traces a packet: its rays together, or one by one if they diverge. */
static inline enum RTCIntersectContextFlags find_flags(const vshi_triangles *triangles, bool together) {
    return !triangles->fine && together ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                        : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
}

/* VSHI_SOLID_… of a primitive of a geometry. */
static inline uint8_t find_solid(const vshi_triangles *triangles, unsigned mesh, unsigned local) {
    return triangles->solid[triangles->first[mesh] + local];
}

/* Whether rays have similar directions. */
static bool go_together(const vshi_segment_ray *rays, int count) {
    for (int i = 1; i < count; ++i) {
        const double *a = rays[0].direction, *b = rays[i].direction;
        if (!(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] > COHERENT)) {
            return false;
        }
    }
    return true;
}

/* Moves a far ray's origin up to the scene; false if the ray misses the scene, or ends before it. Each move
 * has the rounding of a double at its distance, so the next move starts again from there. */
static bool approach(double origin[3], const double direction[3], double *far) {
    enum { MOVES = 24 };                /* 1e308 by 1e15 a move */
    static const double MOVED = 0x1p-6; /* no further move if the last one was shorter */
    for (int move = 0; move < MOVES; ++move) {
        double distance = 0.0, along = 0.0;
        for (int axis = 0; axis < 3; ++axis) {
            distance += origin[axis] * origin[axis];
            along -= origin[axis] * direction[axis];
        }
        if (distance <= FAR_ORIGIN * FAR_ORIGIN) {
            return true;
        }
        const double skip = along - FAR_ORIGIN;
        if (!(skip < *far)) { /* not finite either */
            return false;
        }
        if (!(skip > (move == 0 ? 0.0 : MOVED))) {
            /* the scene is in the ball of √3 around 0 */
            return distance <= 2.0 * FAR_ORIGIN * FAR_ORIGIN;
        }
        for (int axis = 0; axis < 3; ++axis) {
            origin[axis] += skip * direction[axis];
        }
        *far -= skip;
    }
    return false;
}

/* Sets lane `lane` of a packet of zeros, in the scene's units; false if the ray ends before the scene. */
static bool aim(const vshi_triangles *triangles, const vshi_segment_ray *ray, struct RTCRay16 *packet,
                int lane) {
    double origin[3], far = ray->far * triangles->scale;
    for (int axis = 0; axis < 3; ++axis) {
        origin[axis] = (ray->origin[axis] - triangles->centre[axis]) * triangles->scale;
    }
    if (!approach(origin, ray->direction, &far)) {
        return false;
    }
    packet->org_x[lane] = (float)origin[0];
    packet->org_y[lane] = (float)origin[1];
    packet->org_z[lane] = (float)origin[2];
    packet->dir_x[lane] = (float)ray->direction[0];
    packet->dir_y[lane] = (float)ray->direction[1];
    packet->dir_z[lane] = (float)ray->direction[2];
    packet->tfar[lane] = far < (double)FLT_MAX ? (float)far : INFINITY;
    packet->mask[lane] = 0xffffffffu;
    return true;
}

/* Copies half of a packet, row by row of PACKET values. */
static void copy_half(int half, const struct RTCRay16 *whole, struct RTCRay8 *part) {
    const float *from = whole->org_x;
    float *to = part->org_x;
    for (size_t row = 0; row < sizeof *part / (8 * sizeof *to); ++row) {
        memcpy(to + 8 * row, from + 16 * row + 8 * half, 8 * sizeof *to);
    }
}

/* Traces a packet: sets tfar of each valid ray that meets something to -∞. */
static void occlude(const vshi_triangles *triangles, const int *valid, struct RTCIntersectContext *context,
                    struct RTCRay16 *packet) {
    if (triangles->wide) {
        triangles->embree->rtcOccluded16(valid, triangles->scene, context, packet);
        return;
    }
    for (int half = 0; half < 2; ++half) {
        struct RTCRay8 part;
        copy_half(half, packet, &part);
        triangles->embree->rtcOccluded8(valid + 8 * half, triangles->scene, context, &part);
        memcpy(packet->tfar + 8 * half, part.tfar, sizeof part.tfar);
    }
}

typedef struct crossing {
    float distance;
    int8_t out; /* 1: out of a solid, -1: into one */
} crossing;

/* A context of Embree's, and data for its filter. */
typedef struct query {
    struct RTCIntersectContext context; /* first: the filter gets its address */
    const vshi_triangles *triangles;
    bool vessels; /* of pass_sheets(): rays meet vessels, too */
    size_t count;
    crossing *crossings; /* of pass_sheets(); NULL: only the first is wanted */
} query;

static query begin_query(const vshi_triangles *triangles, RTCFilterFunctionN filter) {
    query q = {.triangles = triangles};
    rtcInitIntersectContext(&q.context);
    q.context.filter = filter;
    return q;
}

static void find_blocked(const vshi_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                         RTCFilterFunctionN filter, bool *blocked) {
    query q = begin_query(triangles, filter);
    for (size_t begin = 0; begin < count; begin += PACKET) {
        struct RTCRay16 packet = {0};
        _Alignas(64) int valid[PACKET] = {0};
        const int lanes = count - begin < PACKET ? (int)(count - begin) : PACKET;
        for (int lane = 0; lane < lanes; ++lane) {
            valid[lane] = aim(triangles, &rays[begin + (size_t)lane], &packet, lane) ? -1 : 0;
        }
        q.context.flags = find_flags(triangles, go_together(rays + begin, lanes));
        occlude(triangles, valid, &q.context, &packet);
        for (int lane = 0; lane < lanes; ++lane) {
            blocked[begin + (size_t)lane] = valid[lane] != 0 && packet.tfar[lane] < 0.0f;
        }
    }
}

void vshi_triangles_blocked(const vshi_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                            bool *blocked) {
    find_blocked(triangles, rays, count, NULL, blocked);
}

/* An Embree filter: lets rays pass the fronts of triangles. A solid's faces look away from it, even if a
 * transform mirrors them; the corners' order decides for sheets. */
static void pass_fronts(const struct RTCFilterFunctionNArguments *args) {
    const vshi_triangles *triangles = ((const query *)args->context)->triangles;
    const size_t n = args->N;
    const float *ray = (const float *)args->ray, *hit = (const float *)args->hit;
    const unsigned *of = (const unsigned *)args->hit;
    for (size_t i = 0; i < n; ++i) {
        if (args->valid[i] != -1) {
            continue;
        }
        float along = 0.0f;
        for (size_t axis = 0; axis < 3; ++axis) {
            along += ray[(VSHI_RAY_DIRECTION + axis) * n + i] * hit[(VSHI_HIT_NORMAL + axis) * n + i];
        }
        const uint8_t solid =
            find_solid(triangles, of[VSHI_HIT_MESH * n + i], of[VSHI_HIT_TRIANGLE * n + i]) & VSHI_SOLID_SIDE;
        if (!(solid == VSHI_SOLID_BEFORE ? along < 0.0f : along > 0.0f)) {
            args->valid[i] = 0;
        }
    }
}

void vshi_triangles_meet_backs(const vshi_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                               bool *met) {
    find_blocked(triangles, rays, count, pass_fronts, met);
}

/* --- rays that find solids: which side of a triangle they meet, and how often they cross one */

/* Most crossings of one ray that are recorded. */
enum { MOST_CROSSINGS = 256 };

/* 1 if a ray of this direction leaves the solid of a triangle with this normal, -1 if it enters it, 0 for a
 * sheet. */
static int8_t crosses(uint8_t solid, vshi_vec normal, vshi_vec direction) {
    if ((solid & VSHI_SOLID_SIDE) == VSHI_AIR_AROUND) {
        return 0;
    }
    const bool forwards = vshi_dot(normal, direction) > 0.0;
    return forwards == ((solid & VSHI_SOLID_SIDE) == VSHI_SOLID_BEHIND) ? 1 : -1;
}

/* An Embree filter: lets rays pass sheets. If all crossings are wanted, records each and goes on. */
static void pass_sheets(const struct RTCFilterFunctionNArguments *args) {
    query *q = (query *)args->context;
    const size_t n = args->N;
    const float *ray = (const float *)args->ray;
    const unsigned *hit = (const unsigned *)args->hit;
    for (size_t i = 0; i < n; ++i) {
        if (args->valid[i] != -1) {
            continue;
        }
        const uint8_t solid =
            find_solid(q->triangles, hit[VSHI_HIT_MESH * n + i], hit[VSHI_HIT_TRIANGLE * n + i]);
        const int8_t out = crosses(solid, vshi_packet_vector(args->hit, VSHI_HIT_NORMAL, n, i),
                                   vshi_packet_vector(ray, VSHI_RAY_DIRECTION, n, i));
        const bool vessel = (solid & VSHI_SOLID_VESSEL) != 0;
        const bool sheet = vessel ? !q->vessels : solid == VSHI_AIR_AROUND;
        if (sheet || q->crossings != NULL) {
            args->valid[i] = 0;
        }
        if (!sheet && q->crossings != NULL && q->count < MOST_CROSSINGS) {
            q->crossings[q->count++] = (crossing){ray[VSHI_RAY_FAR * n + i], out};
        }
    }
}

/* VSHI_MEETS_… of a traced ray. */
static uint8_t find_met(const vshi_triangles *triangles, const struct RTCRayHit *ray) {
    const struct RTCHit *hit = &ray->hit;
    if (hit->geomID == RTC_INVALID_GEOMETRY_ID) {
        return VSHI_MEETS_NOTHING;
    }
    const uint8_t solid = find_solid(triangles, hit->geomID, hit->primID);
    const vshi_vec normal = {(double)hit->Ng_x, (double)hit->Ng_y, (double)hit->Ng_z};
    const vshi_vec direction = {(double)ray->ray.dir_x, (double)ray->ray.dir_y, (double)ray->ray.dir_z};
    const bool out = crosses(solid, normal, direction) > 0;
    return !out ? VSHI_MEETS_AIR : (solid & VSHI_SOLID_HOLED) != 0 ? VSHI_MEETS_HOLED : VSHI_MEETS_SOLID;
}

/* Traces a lone ray. Its hit has no geometry if it meets nothing. */
static struct RTCRayHit trace_lone(const vshi_triangles *triangles, const vshi_segment_ray *ray,
                                   struct RTCIntersectContext *context) {
    struct RTCRayHit lone = {.hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
    struct RTCRay16 aimed;
    if (aim(triangles, ray, &aimed, 0)) {
        lone.ray = (struct RTCRay){.org_x = aimed.org_x[0],
                                   .org_y = aimed.org_y[0],
                                   .org_z = aimed.org_z[0],
                                   .dir_x = aimed.dir_x[0],
                                   .dir_y = aimed.dir_y[0],
                                   .dir_z = aimed.dir_z[0],
                                   .tfar = aimed.tfar[0],
                                   .mask = 0xffffffffu};
        triangles->embree->rtcIntersect1(triangles->scene, context, &lone);
    }
    return lone;
}

/* Traces ray by ray: where solids touch, two faces lie at one place, and the one that a packet finds depends
 * on its other rays. */
void vshi_triangles_meet(const vshi_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                         uint8_t *meets) {
    query q = begin_query(triangles, pass_sheets);
    for (size_t i = 0; i < count; ++i) {
        const struct RTCRayHit lone = trace_lone(triangles, &rays[i], &q.context);
        meets[i] = find_met(triangles, &lone);
    }
}

bool vshi_triangles_meet_inner(const vshi_triangles *triangles, const vshi_segment_ray *ray) {
    query q = begin_query(triangles, pass_sheets);
    q.vessels = true;
    const struct RTCRayHit lone = trace_lone(triangles, ray, &q.context);
    return find_met(triangles, &lone) >= VSHI_MEETS_SOLID;
}

/* Whether a crossing comes before another. At one place entering comes first, whatever order Embree finds
 * them in. */
static bool comes_before(crossing a, crossing b) {
    return a.distance < b.distance || (a.distance == b.distance && a.out < b.out);
}

/* By insertion, as crossings are few. */
static void sort_crossings(crossing *crossings, size_t count) {
    for (size_t i = 1; i < count; ++i) {
        const crossing moved = crossings[i];
        size_t k = i;
        for (; k > 0 && comes_before(moved, crossings[k - 1]); --k) {
            crossings[k] = crossings[k - 1];
        }
        crossings[k] = moved;
    }
}

int vshi_triangles_depth(const vshi_triangles *triangles, const vshi_segment_ray *ray) {
    crossing crossings[MOST_CROSSINGS];
    query q = begin_query(triangles, pass_sheets);
    q.crossings = crossings;
    trace_lone(triangles, ray, &q.context);
    sort_crossings(crossings, q.count);
    int left = 0, most = 0;
    for (size_t i = 0; i < q.count; ++i) {
        left += crossings[i].out;
        most = left > most ? left : most;
    }
    return most;
}

double vshi_triangles_distance(const vshi_triangles *triangles, const vshi_segment_ray *ray) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    const struct RTCRayHit lone = trace_lone(triangles, ray, &context);
    return lone.hit.geomID != RTC_INVALID_GEOMETRY_ID ? (double)lone.ray.tfar / triangles->scale : ray->far;
}

bool vshi_triangles_have_solids(const vshi_triangles *triangles) {
    return triangles->has_solids;
}

bool vshi_triangles_have_holes(const vshi_triangles *triangles) {
    return triangles->has_holes;
}

bool vshi_triangles_have_vessels(const vshi_triangles *triangles) {
    return triangles->has_vessels;
}

void vshi_triangles_bounds(const vshi_triangles *triangles, double low[3], double high[3]) {
    memcpy(low, triangles->low, sizeof triangles->low);
    memcpy(high, triangles->high, sizeof triangles->high);
}

double vshi_triangles_offset(const vshi_triangles *triangles) {
    return OFFSET * triangles->size;
}

/* --- packets of rays of neighbouring points, each over its own disc or dome
 *
 * All discs use the points of one net; each texel shifts their digits (sampler.h). A block of 2^k points has
 * one point in each of 2^k cells of the square; a shift permutes the cells. So each texel has one ray in any
 * cell, and the rays of one cell, which have similar directions, make a packet. On lobes of 50,000 triangles,
 * under a sun of 30°, a ray takes 24 ns; with packets in the order of the index it takes 52 ns. */

static const float QUARTER = 0.78539816339744831f; /* π / 4 */

/* A packet's discs: the data that all of their rays share. */
typedef struct group {
    struct RTCRay16 ray;
    float axis[3][PACKET], u[3][PACKET], v[3][PACKET], normal[3][PACKET], far[PACKET];
    float rise[PACKET], lean[2][PACKET]; /* of domes: vshi_lean */
    bool leans;                          /* any dome does */
    uint32_t shift[2][PACKET];
    float lowest[PACKET]; /* least component along the normal: 0, or -∞ without a horizon */
    int valid[PACKET];    /* -1: the lane has a disc */
    int used;             /* discs */
} group;

static void set_lane(const vshi_triangles *t, const vshi_disc *disc, int lane, group *g) {
    float *const from[3] = {g->ray.org_x, g->ray.org_y, g->ray.org_z};
    const double axis[3] = {disc->axis.x, disc->axis.y, disc->axis.z};
    const double u[3] = {disc->u.x, disc->u.y, disc->u.z}, v[3] = {disc->v.x, disc->v.y, disc->v.z};
    const double normal[3] = {disc->normal.x, disc->normal.y, disc->normal.z};
    for (size_t k = 0; k < 3; ++k) {
        from[k][lane] = (float)((disc->origin[k] - t->centre[k]) * t->scale);
        g->axis[k][lane] = (float)axis[k];
        g->u[k][lane] = (float)u[k];
        g->v[k][lane] = (float)v[k];
        g->normal[k][lane] = (float)normal[k];
    }
    const double far = disc->far * t->scale;
    g->far[lane] = far < (double)FLT_MAX ? (float)far : INFINITY;
    g->lowest[lane] = normal[0] != 0.0 || normal[1] != 0.0 || normal[2] != 0.0 ? 0.0f : -INFINITY;
    g->leans = g->leans || disc->lean.rise < 1.0;
    g->rise[lane] = (float)disc->lean.rise;
    g->lean[0][lane] = (float)disc->lean.x;
    g->lean[1][lane] = (float)disc->lean.y;
    g->shift[0][lane] = disc->shift[0];
    g->shift[1][lane] = disc->shift[1];
    g->ray.mask[lane] = 0xffffffffu;
}

/* Maps digits to the unit disc (Shirley and Chiu, "A low distortion map between disk and square", 1997). The
 * series for angles are exact to 4e-7. */
static inline void to_disc(uint32_t digits[2][PACKET], float x[PACKET], float y[PACKET]) {
    for (int l = 0; l < PACKET; ++l) {
        const float a = (float)(int32_t)(digits[0][l] ^ 0x80000000u) * 0x1p-31f;
        const float b = (float)(int32_t)(digits[1][l] ^ 0x80000000u) * 0x1p-31f;
        const bool wide = fabsf(a) > fabsf(b);
        const float radius = wide ? a : b, across = wide ? b : a;
        const float angle = QUARTER * (across / (radius != 0.0f ? radius : 1.0f)), q = angle * angle;
        const float sine = angle * (1.0f + q * (-1.0f / 6.0f + q * (1.0f / 120.0f - q * (1.0f / 5040.0f))));
        const float cosine =
            1.0f + q * (-0.5f + q * (1.0f / 24.0f + q * (-1.0f / 720.0f + q * (1.0f / 40320.0f))));
        x[l] = radius * (wide ? cosine : sine);
        y[l] = radius * (wide ? sine : cosine);
    }
}

/* Aims the lanes at places of their discs. A ray below its disc's horizon is not valid. */
static inline void aim_at_discs(group *g, const float x[PACKET], const float y[PACKET], int valid[PACKET]) {
    struct RTCRay16 *r = &g->ray;
    for (int l = 0; l < PACKET; ++l) {
        const float dx = g->axis[0][l] + (g->u[0][l] * x[l] + g->v[0][l] * y[l]);
        const float dy = g->axis[1][l] + (g->u[1][l] * x[l] + g->v[1][l] * y[l]);
        const float dz = g->axis[2][l] + (g->u[2][l] * x[l] + g->v[2][l] * y[l]);
        const float unit = 1.0f / sqrtf(dx * dx + dy * dy + dz * dz);
        r->dir_x[l] = dx * unit;
        r->dir_y[l] = dy * unit;
        r->dir_z[l] = dz * unit;
        const float up = dx * g->normal[0][l] + dy * g->normal[1][l] + dz * g->normal[2][l];
        valid[l] = up > g->lowest[l] ? g->valid[l] : 0;
    }
}

/* vshi_dome_place() */
static inline void place_on_domes(const group *g, float x[PACKET], float y[PACKET]) {
    for (int l = 0; l < PACKET; ++l) {
        const float along = x[l] * g->lean[0][l] + y[l] * g->lean[1][l];
        const float edge = 1.0f - (x[l] * x[l] + y[l] * y[l]) + along * along;
        const float to = (1.0f + g->rise[l]) * along + (1.0f - g->rise[l]) * sqrtf(edge > 0.0f ? edge : 0.0f);
        const float by = 0.5f * to - along;
        x[l] += by * g->lean[0][l];
        y[l] += by * g->lean[1][l];
    }
}

/* Aims the lanes at places of their domes. */
static inline void aim_at_domes(group *g, float x[PACKET], float y[PACKET], int valid[PACKET]) {
    struct RTCRay16 *r = &g->ray;
    if (g->leans) {
        place_on_domes(g, x, y);
    }
    for (int l = 0; l < PACKET; ++l) {
        const float square = 1.0f - (x[l] * x[l] + y[l] * y[l]);
        const float z = sqrtf(square > 0.0f ? square : 0.0f);
        r->dir_x[l] = g->axis[0][l] * z + (g->u[0][l] * x[l] + g->v[0][l] * y[l]);
        r->dir_y[l] = g->axis[1][l] * z + (g->u[1][l] * x[l] + g->v[1][l] * y[l]);
        r->dir_z[l] = g->axis[2][l] * z + (g->u[2][l] * x[l] + g->v[2][l] * y[l]);
        valid[l] = g->valid[l];
    }
}

/* Traces a block of `size` points of the net for a group, in the order of the cells. The first 2^each lanes
 * have a disc each; the next 2^each have the same discs in the next cell, and so on. */
static void trace_block(const vshi_triangles *t, const uint32_t (*points)[2], bool domes, group *g, int each,
                        uint32_t size, int32_t *lit) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = find_flags(t, true);
    uint32_t cell[PACKET];
    int32_t seen[PACKET] = {0};
    for (int l = 0; l < PACKET; ++l) {
        const uint32_t beyond = (uint32_t)l >> each;
        g->valid[l] = (l & ((1 << each) - 1)) < g->used && beyond < size ? -1 : 0;
        cell[l] = (beyond < size ? beyond : 0) ^ vshi_sampler_cell(size, g->shift[0][l], g->shift[1][l]);
    }
    for (uint32_t c = 0; c < size; c += (uint32_t)PACKET >> each) {
        uint32_t digits[2][PACKET];
        float x[PACKET], y[PACKET];
        _Alignas(64) int valid[PACKET];
        for (int l = 0; l < PACKET; ++l) {
            const uint32_t *point = points[c ^ cell[l]];
            digits[0][l] = point[0] ^ g->shift[0][l];
            digits[1][l] = point[1] ^ g->shift[1][l];
        }
        to_disc(digits, x, y);
        if (domes) {
            aim_at_domes(g, x, y, valid);
        } else {
            aim_at_discs(g, x, y, valid);
        }
        memcpy(g->ray.tfar, g->far, sizeof g->far);
        occlude(t, valid, &context, &g->ray);
        for (int l = 0; l < PACKET; ++l) {
            seen[l] += valid[l] & (g->ray.tfar[l] >= 0.0f); /* -∞ if the ray meets something */
        }
    }
    for (int l = 0; l < PACKET; ++l) {
        if (g->valid[l] != 0) {
            lit[l & ((1 << each) - 1)] += seen[l];
        }
    }
}

bool vshi_triangles_sees(const vshi_triangles *triangles, const double origin[3]) {
    double distance = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double at = (origin[axis] - triangles->centre[axis]) * triangles->scale;
        distance += at * at;
    }
    return distance <= FAR_ORIGIN * FAR_ORIGIN;
}

void vshi_triangles_discs(const vshi_triangles *triangles, const vshi_sampler *sampler, bool domes,
                          const vshi_disc *discs, size_t count, int32_t first, int32_t last, int32_t *lit) {
    for (size_t begin = 0; begin < count; begin += PACKET) {
        group g = {.used = count - begin < PACKET ? (int)(count - begin) : PACKET};
        int each = 0;
        while (1 << each < g.used) {
            ++each;
        }
        for (int l = 0; l < PACKET; ++l) {
            const int k = l & ((1 << each) - 1);
            set_lane(triangles, &discs[begin + (size_t)(k < g.used ? k : 0)], l, &g);
        }
        /* blocks of the net: the first has VSHI_SAMPLER_BLOCK points, each further one as many as all before
         */
        for (int32_t at = first; at < last;) {
            const int32_t size = at == 0 ? VSHI_SAMPLER_BLOCK : at;
            trace_block(triangles, vshi_sampler_cells(sampler, (uint32_t)at), domes, &g, each, (uint32_t)size,
                        lit + begin);
            at += size;
        }
    }
}
