/* Computes the truth of a model's lightmap at texel centres, by Embree rays against its triangles. AO is over
 * the hemisphere of the smooth normal. Directions below the face count neither as open nor as hidden.
 * A separate file has the solids; their faces look outwards.
 *
 *   vsh_judge truth MODEL SIZE X,Y,Z DEGREES DISTANCE RAYS[:N] SOLIDS.obj|- OUT.exr
 *       verdict, shadow, ao, apart and triangle of every texel, or of one in N (judge.h) */
#include "directions.h"
#include "embree_scene.h"
#include "judge.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/vdbshade.h>

/* Shares of rays that meet backs. Without a file of solids, open meshes are judged more strictly. */
static const double FEW = 0.2, MOST = 0.8, FEW_OF_MODEL = 0.05;
static const double BORDER = 1e-3; /* texels */
static const double LIFT = 1e-6;   /* share of the model's size: several rounding errors of Embree */
static const double TOUCH = 6.0;   /* lifts: closer solids touch */
enum { VERDICT_RAYS = 96, FIRST_RAYS = 64 };
static const double PI = 3.14159265358979323846;

typedef struct work {
    const judge_question *question;
    const judge_scene *scene;
    judge_truth *truth;
    truth_frame sun;
    double (*few)[3], (*sun_rays)[3], (*ao_rays)[3]; /* in a frame's axes */
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

bool judge_hidden(const judge_scene *scene, const double from[3], const double towards[3], double reach) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRayHit r = ray_of(scene->traced, from, towards, reach);
    rtcOccluded1(scene->traced->scene, &context, &r.ray);
    return r.ray.tfar < 0.0f;
}

typedef struct gathering {
    struct RTCIntersectContext context; /* first: Embree hands on its address */
    const double *along;
    bool against; /* a face is opposite to `along` */
    int backs;    /* minus fronts, along the ray */
} gathering;

/* Visits every face along a ray. */
static void gather(const struct RTCFilterFunctionNArguments *arguments) {
    gathering *g = (gathering *)(void *)arguments->context;
    const struct RTCHit *hit =
        (const struct RTCHit *)arguments->hit; /* with N = 1 the layout is that of RTCHit */
    const double n[3] = {(double)hit->Ng_x, (double)hit->Ng_y, (double)hit->Ng_z};
    const double cosine = dot(n, g->along) / sqrt(dot(n, n));
    g->against = g->against || cosine < -0.99;
    g->backs += cosine > 0.0 ? 1 : -1; /* Embree's normals face the anticlockwise side */
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

/* Distance to the first hit, and whether it is a back. */
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

/* True if a ray begins inside a solid, which it leaves more often than it enters (solids may overlap), or
 * behind the wall of a room. Of two coincident walls, back to back, the one that faces the ray counts. */
static bool is_behind(const judge_scene *s, const double from[3], const double towards[3], bool hollows) {
    bool back, unused;
    if (s->unknown) {
        first_on(s->solids, from, towards, &back);
        return back;
    }
    if (all_on(s->solids, from, towards, INFINITY).backs +
            (hollows ? all_on(s->hollows, from, towards, INFINITY).backs : 0) >
        0) {
        return true;
    }
    if (s->rooms == NULL) {
        return false;
    }
    const double wall = first_on(s->rooms, from, towards, &back);
    if (!back || wall > first_on(s->solids, from, towards, &unused)) {
        return false;
    }
    const double near = TOUCH * s->lift / s->solid_scale;
    double before[3];
    for (int k = 0; k < 3; ++k) {
        before[k] = from[k] + fmax(0.0, wall - near) * towards[k];
    }
    return all_on(s->rooms, before, towards, 2.0 * near).backs > 0;
}

/* True if a solid or room touches another: an opposite face lies within TOUCH. */
static bool touches(const judge_scene *s, const double at[3], const double g[3]) {
    const double near = TOUCH * s->lift / s->solid_scale;
    double under[3];
    for (int k = 0; k < 3; ++k) {
        under[k] = at[k] - near * g[k];
    }
    return all_on(s->solids, under, g, 2.0 * near).against ||
           (s->rooms != NULL && all_on(s->rooms, under, g, 2.0 * near).against);
}

static int count_behind(const judge_scene *s, const double start[3], const double g[3], bool hollows) {
    const truth_frame frame = truth_frame_around(g);
    int backs = 0;
    for (int i = 0; i < VERDICT_RAYS; ++i) {
        double towards[3];
        truth_cosine_direction(&frame, (size_t)i, VERDICT_RAYS, towards);
        backs += is_behind(s, start, towards, hollows) ? 1 : 0;
    }
    return backs;
}

int judge_verdict(const judge_scene *s, const double p[3], const double g[3]) {
    double at[3], start[3];
    for (int k = 0; k < 3; ++k) {
        at[k] = p[k] / s->solid_scale;
        start[k] = at[k] + s->lift / s->solid_scale * g[k];
    }
    const int backs = count_behind(s, start, g, false);
    if (backs <= (s->unknown ? FEW_OF_MODEL : FEW) * VERDICT_RAYS) {
        const bool either =
            touches(s, at, g) || (s->hollows != NULL && count_behind(s, start, g, true) > FEW * VERDICT_RAYS);
        return either ? JUDGE_UNCLEAR : JUDGE_VALID;
    }
    return backs < MOST * VERDICT_RAYS || touches(s, at, g) ? JUDGE_UNCLEAR : JUDGE_INVALID;
}

static float shadow_of(const work *w, const double start[3], const double g[3]) {
    const size_t counts[2] = {FIRST_RAYS, (size_t)w->question->rays};
    size_t lit = 0;
    for (int pass = 0; pass < 2; ++pass) {
        lit = 0;
        for (size_t i = 0; i < counts[pass]; ++i) {
            double towards[3];
            truth_to_world(&w->sun, pass == 0 ? w->few[i] : w->sun_rays[i], towards);
            lit += dot(towards, g) > 0.0 && !judge_hidden(w->scene, start, towards, INFINITY) ? 1 : 0;
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
    size_t above = 0, open = 0;
    for (size_t i = 0; i < rays; ++i) {
        double towards[3];
        truth_to_world(&frame, w->ao_rays[i], towards);
        if (dot(towards, g) > 0.0) {
            ++above;
            open += judge_hidden(w->scene, start, towards, w->question->distance) ? 0 : 1;
        }
    }
    return above > 0 ? (float)((double)open / (double)above) : 1.0f;
}

/* The directions of all points, once. */
static void aim(work *w) {
    static const truth_frame axes = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    const double radius = tan(0.5 * w->question->angle * PI / 180.0);
    const size_t rays = (size_t)w->question->rays;
    w->few = judge_take(FIRST_RAYS * sizeof *w->few);
    w->sun_rays = judge_take(rays * sizeof *w->sun_rays);
    w->ao_rays = judge_take(rays * sizeof *w->ao_rays);
    for (size_t i = 0; i < FIRST_RAYS; ++i) {
        truth_light_direction(&axes, radius, i, FIRST_RAYS, w->few[i]);
    }
    for (size_t i = 0; i < rays; ++i) {
        truth_light_direction(&axes, radius, i, rays, w->sun_rays[i]);
        truth_cosine_direction(&axes, i, rays, w->ao_rays[i]);
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
        const judge_triangle *t = &w->scene->triangles[(size_t)w->truth->triangle[i] - 1];
        double at[3], n[3], start[3];
        judge_position(t, (double)(i % (size_t)size) + 0.5, (double)(i / (size_t)size) + 0.5, size, at, n);
        for (int k = 0; k < 3; ++k) {
            start[k] = at[k] + w->scene->lift * t->g[k];
        }
        w->truth->verdict[i] = (float)judge_verdict(w->scene, at, t->g);
        if (w->truth->verdict[i] == JUDGE_INVALID) {
            continue;
        }
        const double height = asin(dot(w->sun.n, t->g)), bend = t->bend;
        const bool horizon =
            bend > 1e-3 && fabs(height) < bend + (0.5 * w->question->angle + 0.5) * PI / 180.0;
        w->truth->apart[i] = horizon ? 1.0f : 0.0f;
        w->truth->shadow[i] = shadow_of(w, start, t->g);
        w->truth->ao[i] = ao_of(w, start, t->g, n);
    }
}

/* The first triangle keeps a texel; one whose centre is nearer than BORDER to a border is left out. */
static void cover(const work *w) {
    const int32_t size = w->question->size;
    for (size_t k = 0; k < w->scene->count; ++k) {
        const judge_triangle *t = &w->scene->triangles[k];
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

judge_scene judge_open(const char *path, const char *solids, int32_t uv_set, double lift) {
    vsh_error error;
    judge_scene s = {.solid_scale = 1.0, .unknown = solids == NULL};
    if (vsh_model_read(path, NULL, &s.model, &error) != VSH_OK) {
        judge_give_up(path, error.message);
    }
    s.mesh_count = vsh_model_mesh_count(s.model);
    s.meshes = judge_take(s.mesh_count * sizeof *s.meshes);
    for (size_t i = 0; i < s.mesh_count; ++i) {
        s.meshes[i] = vsh_model_mesh(s.model, i, uv_set);
    }
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    s.triangles = judge_take_triangles(s.meshes, s.mesh_count, &s.count, low, high);
    const double extent = fmax(high[0] - low[0], fmax(high[1] - low[1], high[2] - low[2]));
    s.lift = lift * extent;
    s.traced = truth_mesh_create(s.meshes, s.mesh_count);
    static const char *const kinds[JUDGE_KINDS] = {"solid:", "room:", "hollow:"};
    truth_mesh **const looked_into[JUDGE_KINDS] = {&s.solids, &s.rooms, &s.hollows};
    if (solids == NULL) {
        s.solids = truth_mesh_create(s.meshes, s.mesh_count);
    }
    for (int kind = 0; solids != NULL && kind < JUDGE_KINDS; ++kind) {
        judge_shape shape = judge_read_solids(solids, kinds[kind]);
        const vsh_mesh mesh = {.positions = shape.positions,
                               .indices = shape.indices,
                               .vertex_count = shape.vertices,
                               .triangle_count = shape.triangles};
        if (shape.triangles > 0 || kind == 0) {
            *looked_into[kind] = truth_mesh_create(&mesh, 1);
        }
        s.solid_scale = extent / fmax(shape.high[0] - shape.low[0],
                                      fmax(shape.high[1] - shape.low[1], shape.high[2] - shape.low[2]));
        for (int k = 0; k < 3 && kind == 0; ++k) {
            if (fabs(low[k] - shape.low[k] * s.solid_scale) > 1e-4 * extent ||
                fabs(high[k] - shape.high[k] * s.solid_scale) > 1e-4 * extent) {
                fprintf(stderr, "judge: %s: axis %d is %g … %g, the solids say %g … %g\n", path, k, low[k],
                        high[k], shape.low[k], shape.high[k]);
            }
        }
        free(shape.positions);
        free(shape.indices);
    }
    if (s.traced == NULL || s.solids == NULL) {
        judge_give_up(path, "no Embree, no truth");
    }
    for (int k = 0; k < JUDGE_KINDS; ++k) {
        if (*looked_into[k] != NULL) {
            rtcSetSceneFlags((*looked_into[k])->scene,
                             RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
            rtcCommitScene((*looked_into[k])->scene);
        }
    }
    return s;
}

void judge_close(judge_scene *s) {
    truth_mesh_free(s->hollows);
    truth_mesh_free(s->rooms);
    truth_mesh_free(s->solids);
    truth_mesh_free(s->traced);
    free(s->triangles);
    free(s->meshes);
    vsh_model_free(s->model);
}

judge_truth judge_make(const char *path, const judge_question *question) {
    judge_scene scene = judge_open(path, question->solids, -1, LIFT);
    const size_t texels = (size_t)question->size * (size_t)question->size;
    judge_truth truth = {judge_take(texels * sizeof(float)), judge_take(texels * sizeof(float)),
                         judge_take(texels * sizeof(float)), judge_take(texels * sizeof(float)),
                         judge_take(texels * sizeof(float)), scene.solid_scale};
    work w = {
        .question = question, .scene = &scene, .truth = &truth, .sun = truth_frame_around(question->towards)};
    aim(&w);
    cover(&w);
    truth_in_pieces(texels, 0, texel, &w);
    free(w.ao_rays);
    free(w.sun_rays);
    free(w.few);
    judge_close(&scene);
    return truth;
}

void judge_free(judge_truth *truth) {
    free(truth->verdict);
    free(truth->shadow);
    free(truth->ao);
    free(truth->apart);
    free(truth->triangle);
}

static int write_truth(char **arguments) {
    judge_question q = {.size = atoi(arguments[1]),
                        .angle = atof(arguments[3]),
                        .distance = atof(arguments[4]),
                        .rays = atoi(arguments[5]),
                        .every = 1,
                        .solids = strcmp(arguments[6], "-") != 0 ? arguments[6] : NULL};
    vsh_error error;
    const char *every = strchr(arguments[5], ':');
    q.every = every != NULL ? atoi(every + 1) : 1;
    if (q.every < 1 ||
        sscanf(arguments[2], "%lf,%lf,%lf", &q.towards[0], &q.towards[1], &q.towards[2]) != 3 || q.size < 1 ||
        q.rays < 1) {
        fputs("judge: size, rays or direction\n", stderr);
        return 2;
    }
    judge_truth t = judge_make(arguments[0], &q);
    static const char *const names[] = {"verdict", "shadow", "ao", "apart", "triangle"};
    const float *const planes[] = {t.verdict, t.shadow, t.ao, t.apart, t.triangle};
    const vsh_image image = {q.size, q.size, 5, names, planes, NULL};
    if (fabs(t.units - 1.0) > 1e-3) {
        printf("%s: lengths are %.6g times those of the solids\n", arguments[0], t.units);
    }
    if (vsh_image_write(arguments[7], &image, NULL, &error) != VSH_OK) {
        fprintf(stderr, "judge: %s\n", error.message);
        return 2;
    }
    judge_free(&t);
    return 0;
}

int main(int argc, char **argv) {
    if (argc == 10 && strcmp(argv[1], "truth") == 0) {
        return write_truth(argv + 2);
    }
    if (argc >= 2 && strcmp(argv[1], "seen") == 0) {
        return judge_seen(argc - 2, argv + 2);
    }
    fputs("usage: vsh_judge truth|seen …, as the first lines of bench/judge_truth.c and judge_seen.c say\n",
          stderr);
    return 2;
}
