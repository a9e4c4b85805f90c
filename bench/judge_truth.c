/* Truth of a model's lightmap, texel by texel at their centres: on the triangles as they are, geometric
 * normals for the horizon, by rays of Embree. What is solid comes from a file of its own, where faces look to
 * the air. */
#include "directions.h"
#include "embree_scene.h"
#include "judge.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/vdbshade.h>

static const double FEW = 0.2, MOST = 0.8;
static const double BORDER = 1e-3; /* texels */
static const double LIFT = 2e-6;   /* of the model's half size: some of Embree's roundings */
static const double TOUCH = 6.0;   /* lifts: solids so near to each other touch */
static const double TILT =
    10.0; /* degrees of a smooth normal off its triangle: what lies beyond is told apart */
enum { VERDICT_RAYS = 96, FIRST_RAYS = 64, KINDS = 3 };
static const double PI = 3.14159265358979323846;

typedef struct work {
    const judge_question *question;
    judge_truth *truth;
    judge_triangle *triangles;
    size_t count;
    const truth_mesh *model, *solids, *rooms, *hollows; /* of the last two NULL where there are none */
    double lift, solid_scale;
    truth_frame sun;
    double (*few)[3], (*sun_rays)[3], (*ao_rays)[3], (*verdict_rays)[3]; /* in a frame's axes */
} work;

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* --- rays */

static struct RTCRayHit ray_of(const truth_mesh *mesh, const double from[3], const double towards[3],
                               double reach) {
    return (struct RTCRayHit){.ray = {.org_x = (float)(from[0] - mesh->center[0]),
                                      .org_y = (float)(from[1] - mesh->center[1]),
                                      .org_z = (float)(from[2] - mesh->center[2]),
                                      .dir_x = (float)towards[0],
                                      .dir_y = (float)towards[1],
                                      .dir_z = (float)towards[2],
                                      .tfar = (float)reach,
                                      .mask = ~0u},
                              .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
}

static bool hidden(const truth_mesh *mesh, const double from[3], const double towards[3], double reach) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRayHit r = ray_of(mesh, from, towards, reach);
    rtcOccluded1(mesh->scene, &context, &r.ray);
    return r.ray.tfar < 0.0f;
}

typedef struct gathering {
    struct RTCIntersectContext context; /* first: Embree hands on its address */
    const double *along;
    bool against; /* a face looks straight against `along` */
    int backs;    /* less fronts, on the way along */
} gathering;

/* Looks at every face on a ray's way. */
static void gather(const struct RTCFilterFunctionNArguments *arguments) {
    gathering *g = (gathering *)(void *)arguments->context;
    const struct RTCHit *hit =
        (const struct RTCHit *)arguments->hit; /* N is 1: packed as a lone hit's fields */
    const double n[3] = {(double)hit->Ng_x, (double)hit->Ng_y, (double)hit->Ng_z};
    const double cosine = dot(n, g->along) / sqrt(dot(n, n));
    g->against = g->against || cosine < -0.99;
    g->backs += cosine > 0.0 ? 1 : -1; /* Embree's normals look to where a triangle is anticlockwise */
    arguments->valid[0] = 0;
}

static gathering all_on(const truth_mesh *mesh, const double from[3], const double along[3], double reach) {
    gathering seen = {.along = along};
    rtcInitIntersectContext(&seen.context);
    seen.context.filter = gather;
    struct RTCRayHit r = ray_of(mesh, from, along, reach);
    rtcIntersect1(mesh->scene, &seen.context, &r);
    return seen;
}

/* How far a ray comes, and whether it meets a back there. */
static double first_on(const truth_mesh *mesh, const double from[3], const double towards[3], bool *back) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRayHit r = ray_of(mesh, from, towards, INFINITY);
    rtcIntersect1(mesh->scene, &context, &r);
    *back =
        r.hit.geomID != RTC_INVALID_GEOMETRY_ID &&
        (double)r.hit.Ng_x * towards[0] + (double)r.hit.Ng_y * towards[1] + (double)r.hit.Ng_z * towards[2] >
            0.0;
    return (double)r.ray.tfar;
}

/* Whether a ray says that it begins within a solid, which it leaves more often than it enters (solids may lie
 * within and across each other), or behind the wall of a room. Where two walls lie in one place, back to
 * back, the one that looks at us is seen. */
static bool is_behind(const work *w, const double from[3], const double towards[3], bool hollows) {
    if (all_on(w->solids, from, towards, INFINITY).backs +
            (hollows ? all_on(w->hollows, from, towards, INFINITY).backs : 0) >
        0) {
        return true;
    }
    bool back, unused;
    if (w->rooms == NULL) {
        return false;
    }
    const double wall = first_on(w->rooms, from, towards, &back);
    if (!back || wall > first_on(w->solids, from, towards, &unused)) {
        return false;
    }
    const double near = TOUCH * w->lift / w->solid_scale;
    double before[3];
    for (int k = 0; k < 3; ++k) {
        before[k] = from[k] + fmax(0.0, wall - near) * towards[k];
    }
    return all_on(w->rooms, before, towards, 2.0 * near).backs > 0;
}

/* Whether a solid or room ends where another begins: a face that looks against this one lies within TOUCH. */
static bool touches(const work *w, const double at[3], const double g[3]) {
    const double near = TOUCH * w->lift / w->solid_scale;
    double under[3];
    for (int k = 0; k < 3; ++k) {
        under[k] = at[k] - near * g[k];
    }
    return all_on(w->solids, under, g, 2.0 * near).against ||
           (w->rooms != NULL && all_on(w->rooms, under, g, 2.0 * near).against);
}

static int count_behind(const work *w, const double start[3], const double g[3], bool hollows) {
    const truth_frame frame = truth_frame_around(g);
    int backs = 0;
    for (int i = 0; i < VERDICT_RAYS; ++i) {
        double towards[3];
        truth_to_world(&frame, w->verdict_rays[i], towards);
        backs += is_behind(w, start, towards, hollows) ? 1 : 0;
    }
    return backs;
}

static int verdict_of(const work *w, const double p[3], const double g[3]) {
    double at[3], start[3];
    for (int k = 0; k < 3; ++k) {
        at[k] = p[k] / w->solid_scale;
        start[k] = at[k] + w->lift / w->solid_scale * g[k];
    }
    const int backs = count_behind(w, start, g, false);
    if (backs <= FEW * VERDICT_RAYS) {
        const bool either = w->hollows != NULL && count_behind(w, start, g, true) > FEW * VERDICT_RAYS;
        return either ? JUDGE_UNCLEAR : JUDGE_VALID;
    }
    return backs < MOST * VERDICT_RAYS || touches(w, at, g) ? JUDGE_UNCLEAR : JUDGE_INVALID;
}

static float shadow_of(const work *w, const double start[3], const double g[3]) {
    const size_t counts[2] = {FIRST_RAYS, (size_t)w->question->rays};
    size_t lit = 0;
    for (int pass = 0; pass < 2; ++pass) {
        lit = 0;
        for (size_t i = 0; i < counts[pass]; ++i) {
            double towards[3];
            truth_to_world(&w->sun, pass == 0 ? w->few[i] : w->sun_rays[i], towards);
            lit += dot(towards, g) > 0.0 && !hidden(w->model, start, towards, INFINITY) ? 1 : 0;
        }
        if (lit == 0 || lit == counts[pass]) {
            return lit > 0 ? 1.0f : 0.0f;
        }
    }
    return (float)((double)lit / (double)counts[1]);
}

static float ao_of(const work *w, const double start[3], const double g[3], const double n[3]) {
    const truth_frame frame = truth_frame_around(n);
    const size_t rays = (size_t)w->question->rays;
    size_t open = 0;
    for (size_t i = 0; i < rays; ++i) {
        double towards[3];
        truth_to_world(&frame, w->ao_rays[i], towards);
        open += dot(towards, g) > 0.0 && !hidden(w->model, start, towards, w->question->distance) ? 1 : 0;
    }
    return (float)((double)open / (double)rays);
}

/* The directions of all points, once. */
static void aim(work *w) {
    static const truth_frame axes = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    const double radius = tan(0.5 * w->question->angle * PI / 180.0);
    const size_t rays = (size_t)w->question->rays;
    w->few = judge_take(FIRST_RAYS * sizeof *w->few);
    w->sun_rays = judge_take(rays * sizeof *w->sun_rays);
    w->ao_rays = judge_take(rays * sizeof *w->ao_rays);
    w->verdict_rays = judge_take(VERDICT_RAYS * sizeof *w->verdict_rays);
    for (size_t i = 0; i < FIRST_RAYS; ++i) {
        truth_light_direction(&axes, radius, i, FIRST_RAYS, w->few[i]);
    }
    for (size_t i = 0; i < rays; ++i) {
        truth_light_direction(&axes, radius, i, rays, w->sun_rays[i]);
        truth_cosine_direction(&axes, i, rays, w->ao_rays[i]);
    }
    for (size_t i = 0; i < VERDICT_RAYS; ++i) {
        truth_cosine_direction(&axes, i, VERDICT_RAYS, w->verdict_rays[i]);
    }
}

/* --- texels */

static void texel(void *user, size_t begin, size_t end) {
    const work *w = user;
    const double size = w->question->size;
    for (size_t i = begin; i < end; ++i) {
        if (w->truth->triangle[i] <= 0.0f) {
            continue;
        }
        const judge_triangle *t = &w->triangles[(size_t)w->truth->triangle[i] - 1];
        double at[3], n[3], start[3];
        judge_position(t, (double)(i % (size_t)size) + 0.5, (double)(i / (size_t)size) + 0.5, size, at, n);
        for (int k = 0; k < 3; ++k) {
            start[k] = at[k] + w->lift * t->g[k];
        }
        w->truth->verdict[i] = (float)verdict_of(w, at, t->g);
        if (w->truth->verdict[i] == JUDGE_INVALID) {
            continue;
        }
        const double height = asin(dot(w->sun.n, t->g)), bend = t->bend;
        const bool horizon =
            bend > 1e-3 && fabs(height) < bend + (0.5 * w->question->angle + 0.5) * PI / 180.0;
        w->truth->apart[i] = horizon || dot(n, t->g) < cos(TILT * PI / 180.0) ? 1.0f : 0.0f;
        w->truth->shadow[i] = shadow_of(w, start, t->g);
        w->truth->ao[i] = ao_of(w, start, t->g, n);
    }
}

/* The first triangle keeps a texel; one whose centre is nearer than BORDER to a border is left out. */
static void cover(const work *w) {
    const int32_t size = w->question->size;
    for (size_t k = 0; k < w->count; ++k) {
        const judge_triangle *t = &w->triangles[k];
        double q[3][2], low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
        for (int c = 0; c < 3; ++c) {
            q[c][0] = t->uv[c][0] * size - 0.5;
            q[c][1] = (1.0 - t->uv[c][1]) * size - 0.5;
            for (int a = 0; a < 2; ++a) {
                low[a] = fmin(low[a], q[c][a]);
                high[a] = fmax(high[a], q[c][a]);
            }
        }
        const double area =
            (q[1][0] - q[0][0]) * (q[2][1] - q[0][1]) - (q[1][1] - q[0][1]) * (q[2][0] - q[0][0]);
        if (area == 0.0 || !isfinite(area)) {
            continue;
        }
        for (int32_t y = (int32_t)fmax(0.0, ceil(low[1])); y <= fmin(size - 1.0, high[1]); ++y) {
            for (int32_t x = (int32_t)fmax(0.0, ceil(low[0])); x <= fmin(size - 1.0, high[0]); ++x) {
                double least = INFINITY;
                for (int c = 0; c < 3; ++c) {
                    const double *a = q[c], *b = q[(c + 1) % 3];
                    const double side = (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
                    least = fmin(least, copysign(1.0, area) * side / hypot(b[0] - a[0], b[1] - a[1]));
                }
                float *keeper = &w->truth->triangle[(size_t)y * (size_t)size + (size_t)x];
                const bool asked = (x + 2 * y) % w->question->every == 0;
                if (least > 0.0 && *keeper == 0.0f && asked) {
                    *keeper = least > BORDER ? (float)(k + 1) : -1.0f;
                }
            }
        }
    }
}

judge_truth judge_make(const char *path, const judge_question *question) {
    vsh_error error;
    vsh_model *model = NULL;
    if (vsh_model_read(path, NULL, &model, &error) != VSH_OK) {
        judge_give_up(path, error.message);
    }
    const size_t mesh_count = vsh_model_mesh_count(model);
    vsh_mesh *meshes = judge_take(mesh_count * sizeof *meshes);
    for (size_t i = 0; i < mesh_count; ++i) {
        meshes[i] = vsh_model_mesh(model, i, -1);
    }
    const size_t texels = (size_t)question->size * (size_t)question->size;
    judge_truth truth = {judge_take(texels * sizeof(float)), judge_take(texels * sizeof(float)),
                         judge_take(texels * sizeof(float)), judge_take(texels * sizeof(float)),
                         judge_take(texels * sizeof(float)), 1.0};
    work w = {.question = question, .truth = &truth, .solid_scale = 1.0};
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    w.triangles = judge_take_triangles(meshes, mesh_count, &w.count, low, high);
    const double extent = fmax(high[0] - low[0], fmax(high[1] - low[1], high[2] - low[2]));
    w.lift = 0.5 * LIFT * extent;
    w.sun = truth_frame_around(question->towards);
    truth_mesh *mesh = truth_mesh_create(meshes, mesh_count);
    truth_mesh *looked_into[KINDS] = {NULL};
    static const char *const kinds[KINDS] = {"solid:", "room:", "hollow:"};
    if (question->solids == NULL) {
        looked_into[0] = truth_mesh_create(meshes, mesh_count);
    }
    for (int kind = 0; question->solids != NULL && kind < KINDS; ++kind) {
        judge_shape s = judge_read_solids(question->solids, kinds[kind]);
        const vsh_mesh shape = {.positions = s.positions,
                                .indices = s.indices,
                                .vertex_count = s.vertices,
                                .triangle_count = s.triangles};
        if (s.triangles > 0 || kind == 0) {
            looked_into[kind] = truth_mesh_create(&shape, 1);
        }
        truth.units = extent / fmax(s.high[0] - s.low[0], fmax(s.high[1] - s.low[1], s.high[2] - s.low[2]));
        w.solid_scale = truth.units;
        for (int k = 0; k < 3 && kind == 0; ++k) {
            if (fabs(low[k] - s.low[k] * truth.units) > 1e-4 * extent ||
                fabs(high[k] - s.high[k] * truth.units) > 1e-4 * extent) {
                fprintf(stderr, "judge: %s: axis %d is %g … %g, the solids say %g … %g\n", path, k, low[k],
                        high[k], s.low[k], s.high[k]);
            }
        }
        free(s.positions);
        free(s.indices);
    }
    if (mesh == NULL || looked_into[0] == NULL) {
        judge_give_up(path, "no Embree, no truth");
    }
    for (int k = 0; k < KINDS; ++k) {
        if (looked_into[k] != NULL) {
            rtcSetSceneFlags(looked_into[k]->scene,
                             RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
            rtcCommitScene(looked_into[k]->scene);
        }
    }
    w.solids = looked_into[0];
    w.rooms = looked_into[1];
    w.hollows = looked_into[2];
    w.model = mesh;
    aim(&w);
    cover(&w);
    truth_in_pieces(texels, 0, texel, &w);
    for (int k = 0; k < KINDS; ++k) {
        if (looked_into[k] != NULL) {
            truth_mesh_free(looked_into[k]);
        }
    }
    truth_mesh_free(mesh);
    free(w.verdict_rays);
    free(w.ao_rays);
    free(w.sun_rays);
    free(w.few);
    free(w.triangles);
    free(meshes);
    vsh_model_free(model);
    return truth;
}

void judge_free(judge_truth *truth) {
    free(truth->verdict);
    free(truth->shadow);
    free(truth->ao);
    free(truth->apart);
    free(truth->triangle);
}
