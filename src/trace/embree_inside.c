/* Rays that tell where solids are: which side of a triangle they meet, and how often they cross one. */
#include "trace/embree_scene.h"

#include <string.h>

/* Of the casters' size: 64 times what a float's rounding moves a point of theirs. */
static const double LIFT = 0x1p-18;

/* Crossings of one ray that are kept; what a ray crosses beyond them is not looked at. */
enum { MOST_CROSSINGS = 256 };

typedef struct crossing {
    float distance;
    int8_t out; /* 1: out of a solid, -1: into one */
} crossing;

/* A context of Embree's, and what the filter is to know. */
typedef struct looking {
    struct RTCIntersectContext context; /* first: the filter is given this */
    const vsh_triangles *triangles;
    bool vessels; /* they are met, too */
    size_t count;
    crossing *crossings; /* NULL: the first is looked for */
} looking;

/* 1 where a ray of this direction leaves the solid of a triangle with this normal, -1 where it enters it, 0
 * for a sheet. */
static int8_t crosses(uint8_t solid, vshi_vec normal, vshi_vec direction) {
    if ((solid & VSHI_SOLID_SIDE) == VSHI_AIR_AROUND) {
        return 0;
    }
    const bool forwards = vshi_dot(normal, direction) > 0.0;
    return forwards == ((solid & VSHI_SOLID_SIDE) == VSHI_SOLID_BEHIND) ? 1 : -1;
}

/* Sheets are passed by; where all crossings are asked for, each is noted and passed by. */
static void filter(const struct RTCFilterFunctionNArguments *args) {
    looking *look = (looking *)args->context;
    const size_t n = args->N;
    const float *ray = (const float *)args->ray;
    const unsigned *hit = (const unsigned *)args->hit;
    for (size_t i = 0; i < n; ++i) {
        if (args->valid[i] != -1) {
            continue;
        }
        const uint8_t solid =
            vshi_triangles_solid(look->triangles, hit[VSHI_HIT_MESH * n + i], hit[VSHI_HIT_TRIANGLE * n + i]);
        const int8_t out = crosses(solid, vshi_packet_vector(args->hit, VSHI_HIT_NORMAL, n, i),
                                   vshi_packet_vector(ray, VSHI_RAY_DIRECTION, n, i));
        const bool vessel = (solid & VSHI_SOLID_VESSEL) != 0;
        const bool sheet = vessel ? !look->vessels : solid == VSHI_AIR_AROUND;
        if (sheet || look->crossings != NULL) {
            args->valid[i] = 0;
        }
        if (!sheet && look->crossings != NULL && look->count < MOST_CROSSINGS) {
            look->crossings[look->count++] = (crossing){ray[VSHI_RAY_FAR * n + i], out};
        }
    }
}

static void begin_look(looking *look, const vsh_triangles *triangles, crossing *crossings) {
    *look = (looking){.triangles = triangles, .crossings = crossings};
    rtcInitIntersectContext(&look->context);
    look->context.filter = filter;
}

static uint8_t met(const vsh_triangles *triangles, const struct RTCRayHit *ray) {
    const struct RTCHit *hit = &ray->hit;
    if (hit->geomID == RTC_INVALID_GEOMETRY_ID) {
        return VSHI_MEETS_NOTHING;
    }
    const uint8_t solid = vshi_triangles_solid(triangles, hit->geomID, hit->primID);
    const vshi_vec normal = {(double)hit->Ng_x, (double)hit->Ng_y, (double)hit->Ng_z};
    const vshi_vec direction = {(double)ray->ray.dir_x, (double)ray->ray.dir_y, (double)ray->ray.dir_z};
    const bool out = crosses(solid, normal, direction) > 0;
    return !out ? VSHI_MEETS_AIR : (solid & VSHI_SOLID_HOLED) != 0 ? VSHI_MEETS_HOLED : VSHI_MEETS_SOLID;
}

/* Aims a lone ray; false where it has no direction. */
static bool aim_lone(const vsh_triangles *triangles, const vshi_segment_ray *ray, struct RTCRayHit *lone) {
    struct RTCRay16 aimed;
    if (!vshi_triangles_aim(triangles, ray, &aimed, 0)) {
        return false;
    }
    *lone = (struct RTCRayHit){.ray = {.org_x = aimed.org_x[0],
                                       .org_y = aimed.org_y[0],
                                       .org_z = aimed.org_z[0],
                                       .dir_x = aimed.dir_x[0],
                                       .dir_y = aimed.dir_y[0],
                                       .dir_z = aimed.dir_z[0],
                                       .tfar = aimed.tfar[0],
                                       .mask = 0xffffffffu},
                               .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
    return true;
}

/* One ray after the other: where solids touch, faces of two lie in one place, and which of them a packet of
 * rays finds depends on who else is in it. */
void vshi_triangles_meet(const vsh_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                         uint8_t *meets) {
    looking look;
    begin_look(&look, triangles, NULL);
    for (size_t i = 0; i < count; ++i) {
        struct RTCRayHit lone;
        meets[i] = VSHI_MEETS_NOTHING;
        if (aim_lone(triangles, &rays[i], &lone)) {
            triangles->embree->rtcIntersect1(triangles->scene, &look.context, &lone);
            meets[i] = met(triangles, &lone);
        }
    }
}

bool vshi_triangles_meet_inner(const vsh_triangles *triangles, const vshi_segment_ray *ray) {
    looking look;
    struct RTCRayHit lone;
    begin_look(&look, triangles, NULL);
    look.vessels = true;
    if (!aim_lone(triangles, ray, &lone)) {
        return false;
    }
    triangles->embree->rtcIntersect1(triangles->scene, &look.context, &lone);
    return met(triangles, &lone) >= VSHI_MEETS_SOLID;
}

/* Whether one crossing comes before another; of two in the same place that into a solid, so that no order in
 * which Embree finds them shows. */
static bool before(crossing a, crossing b) {
    return a.distance < b.distance || (a.distance == b.distance && a.out < b.out);
}

/* There are few. */
static void sort(crossing *crossings, size_t count) {
    for (size_t i = 1; i < count; ++i) {
        const crossing moved = crossings[i];
        size_t k = i;
        for (; k > 0 && before(moved, crossings[k - 1]); --k) {
            crossings[k] = crossings[k - 1];
        }
        crossings[k] = moved;
    }
}

int vshi_triangles_depth(const vsh_triangles *triangles, const vshi_segment_ray *ray) {
    crossing crossings[MOST_CROSSINGS];
    looking look;
    begin_look(&look, triangles, crossings);
    struct RTCRayHit lone;
    if (!aim_lone(triangles, ray, &lone)) {
        return 0;
    }
    triangles->embree->rtcIntersect1(triangles->scene, &look.context, &lone);
    sort(crossings, look.count);
    int left = 0, most = 0;
    for (size_t i = 0; i < look.count; ++i) {
        left += crossings[i].out;
        most = left > most ? left : most;
    }
    return most;
}

double vshi_triangles_distance(const vsh_triangles *triangles, const vshi_segment_ray *ray) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRayHit lone;
    if (!aim_lone(triangles, ray, &lone)) {
        return ray->far;
    }
    triangles->embree->rtcIntersect1(triangles->scene, &context, &lone);
    return lone.hit.geomID != RTC_INVALID_GEOMETRY_ID ? (double)lone.ray.tfar / triangles->scale : ray->far;
}

bool vshi_triangles_have_solids(const vsh_triangles *triangles) {
    return triangles->has_solids;
}

bool vshi_triangles_have_holes(const vsh_triangles *triangles) {
    return triangles->has_holes;
}

bool vshi_triangles_have_vessels(const vsh_triangles *triangles) {
    return triangles->has_vessels;
}

void vshi_triangles_bounds(const vsh_triangles *triangles, double low[3], double high[3]) {
    memcpy(low, triangles->low, sizeof triangles->low);
    memcpy(high, triangles->high, sizeof triangles->high);
}

double vshi_triangles_lift(const vsh_triangles *triangles) {
    return LIFT * triangles->size;
}
