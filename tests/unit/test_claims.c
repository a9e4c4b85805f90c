/* Reported errors of shadow and AO against closed forms: the true error is at most the error asked for, and
 * the report is at least 0.9 of it. Edges, corners, slits and discs, by every sampler, in lightmaps and of
 * single points. */
#include "shading.h"
#include "texels_of.h"
#include "truth/directions.h"
#include "truth/metrics.h"

/* --- casters with shadow and AO in closed form */

enum { EDGE, CORNER, SLIT, DISC, SHAPES };
static const char *const NAMES[SHAPES] = {"edge", "corner", "slit", "disc"};

enum { ROUND = 1024 };

/* Half angle of the sun as a tangent, */
static double WIDE = 0.25;
/* height and thickness of the casters, AO distance. */
static const double HEIGHT = 1.0, THICK = 0.5, DISTANCE = 1.0;
/* Half the slit, the disc's radius. */
static const double GAP = 0.125, RADIUS = 0.15;

typedef struct stage {
    int shape;
    bool ao;
    float positions[3][3 * (ROUND + 1)];
    uint32_t indices[3 * ROUND];
    vsh_mesh meshes[2];
    size_t mesh_count;
    vsh_field *field;
    vshi_triangles *triangles;
} stage;

static void add_box(stage *s, const double low[3], const double high[3]) {
    s->meshes[s->mesh_count] = box_mesh(s->positions[s->mesh_count], low, high);
    ++s->mesh_count;
}

/* A flat disc, a fan of as large an area as the circle's. */
static void make_disc(stage *s, double height, double radius) {
    float *p = s->positions[0];
    const double a = 2.0 * PI / ROUND, out = radius * sqrt(a / sin(a));
    p[0] = p[2] = 0.0f;
    p[1] = (float)height;
    for (uint32_t k = 0; k < ROUND; ++k) {
        p[3 * k + 3] = (float)(out * cos(a * k));
        p[3 * k + 4] = (float)height;
        p[3 * k + 5] = (float)(out * sin(a * k));
        s->indices[3 * k] = 0;
        s->indices[3 * k + 1] = k + 1;
        s->indices[3 * k + 2] = (k + 1) % ROUND + 1;
    }
    s->meshes[s->mesh_count++] = mesh_of_arrays("disc", p, NULL, ROUND + 1, s->indices, ROUND);
}

/* Boxes whose faces lie on planes of the lattice, where a field of them is exact; shadows fall on y = 0.
 * Walls for AO stand in it. */
static stage *make_stage(int shape, bool ao, double voxel) {
    stage *s = calloc(1, sizeof *s);
    assert_non_null(s);
    s->shape = shape;
    s->ao = ao;
    const double y0 = ao ? -0.5 : HEIGHT, y1 = ao ? 1.5 : HEIGHT + THICK, far = 2.0;
    const double all[2][3] = {{-far, y0, -far}, {far, y1, far}};
    if (shape == DISC) {
        make_disc(s, HEIGHT, ao ? 4.0 * RADIUS : RADIUS);
    } else if (shape == CORNER && !ao) {
        add_box(s, (double[]){0.0, y0, 0.0}, all[1]);
    } else {
        add_box(s, (double[]){shape == SLIT && !ao ? GAP : 0.0, y0, -far}, all[1]);
        if (shape == SLIT) {
            add_box(s, all[0], (double[]){ao ? -1.5 : -GAP, y1, far});
        }
        if (shape == CORNER) {
            add_box(s, (double[]){-far, y0, 0.0}, all[1]);
        }
    }
    s->field = field_of_grid(grid_from_meshes(s->meshes, s->mesh_count, voxel), 0.0);
    s->triangles = triangles_from(s->meshes, s->mesh_count);
    return s;
}

static void free_stage(stage **s) {
    vshi_triangles_free((*s)->triangles);
    vshi_field_free((*s)->field);
    free(*s);
}

/* --- closed forms: shares of a unit disc */

/* Where x < a and y < b. */
static double below_both(double a, double b) {
    if (a <= -1.0 || b <= -1.0) {
        return 0.0;
    }
    if (a >= 1.0 || b >= 1.0) {
        return a >= 1.0 ? b >= 1.0 ? 1.0 : truth_disc_share(b) : truth_disc_share(a);
    }
    if (a * a + b * b >= 1.0) { /* the corner is outside the disc */
        return a > 0.0 && b > 0.0 ? truth_disc_share(a) + truth_disc_share(b) - 1.0
               : a > 0.0          ? truth_disc_share(b)
               : b > 0.0          ? truth_disc_share(a)
                                  : 0.0;
    }
    /* half of each part that the lines through the corner cut off, and the rest by the corner's rectangle:
     * d²/da db of the share is 1 / π in the disc */
    return 0.5 * (truth_disc_share(a) + truth_disc_share(b)) - 0.25 + a * b / PI;
}

/* The share of the unit disc in a circle of radius r whose centre is `apart` from the disc's. */
static double overlap(double r, double apart) {
    if (apart >= 1.0 + r) {
        return 0.0;
    }
    if (apart <= fabs(1.0 - r)) {
        return r < 1.0 ? r * r : 1.0;
    }
    const double x = (apart * apart + 1.0 - r * r) / (2.0 * apart), y = apart - x;
    const double h = sqrt(fmax(0.0, 1.0 - x * x));
    return (acos(x) - x * h + r * r * acos(fmin(1.0, fmax(-1.0, y / r))) - y * h) / PI;
}

/* Where a face at `off` ends the light, in radii of its disc. Its upper edge counts if it stands beside the
 * receiver, its lower edge if it is above. */
static double limit(double off) {
    return off / (off > 0.0 ? HEIGHT + THICK : HEIGHT) / WIDE;
}

/* The corner's edges, seen from beside one and under the other, hide what lies between their ends: the part
 * of each line of the disc is known. */
static double beside_corner(double x, double z) {
    enum { LINES = 4000 };
    double hidden = 0.0;
    for (int k = 0; k < LINES; ++k) {
        const double angle = PI * ((k + 0.5) / LINES - 0.5), v = sin(angle), half = cos(angle);
        /* heights at which the line is behind the corner's edge along x */
        const double rise = WIDE * v;
        double low = HEIGHT, high = HEIGHT + THICK;
        if (z + low * rise <= 0.0 && z + high * rise <= 0.0) {
            continue;
        }
        if (z + low * rise <= 0.0) {
            low = -z / rise;
        } else if (z + high * rise <= 0.0) {
            high = -z / rise;
        }
        const double least = fmin(-x / low, -x / high) / WIDE;
        const double from = fmax(least, -half);
        hidden += from < half ? (half - from) * half : 0.0;
    }
    return 1.0 - hidden / LINES;
}

static double shadow_truth(const stage *s, double x, double z) {
    switch (s->shape) {
    case EDGE:
        return truth_disc_share(fmin(1.0, fmax(-1.0, limit(-x))));
    case SLIT:
        return fmax(0.0, truth_disc_share(fmin(1.0, fmax(-1.0, limit(GAP - x)))) +
                             truth_disc_share(fmin(1.0, fmax(-1.0, limit(GAP + x)))) - 1.0);
    case CORNER:
        return beside_corner(x, z);
    default:
        return 1.0 - overlap(RADIUS / HEIGHT / WIDE, hypot(x, z) / HEIGHT / WIDE);
    }
}

/* Malley's: directions are even over the disc below them, and walls hide where they are nearer than the
 * distance. */
static double ao_truth(const stage *s, double x, double z) {
    switch (s->shape) {
    case EDGE:
        return truth_disc_share(fmin(1.0, -x / DISTANCE));
    case SLIT:
        return truth_disc_share(fmin(1.0, -x / DISTANCE)) +
               truth_disc_share(fmin(1.0, (1.5 + x) / DISTANCE)) - 1.0;
    case CORNER:
        return below_both(-x / DISTANCE, -z / DISTANCE);
    default: { /* a parallel disc: Hottel's configuration factor */
        const double h = HEIGHT / (4.0 * RADIUS), r = hypot(x, z) / (4.0 * RADIUS), sum = 1.0 + h * h + r * r;
        return 1.0 - 0.5 * (1.0 - (h * h + r * r - 1.0) / sqrt(sum * sum - 4.0 * r * r));
    }
    }
}

static double truth_at(const stage *s, double x, double z) {
    return s->ao ? ao_truth(s, x, z) : shadow_truth(s, x, z);
}

/* --- reported errors and true ones */

enum { MOST_TEXELS = 1 << 13 };

typedef struct trial {
    int32_t method, sampler; /* of shadow, or of AO */
    double max_error;
    int32_t width, height;
    bool lightmap; /* else points in an order that separates neighbours */
    bool held;     /* lightmap: also compared with the casters */
} trial;

typedef struct outcome {
    double measured, claimed, worst, rays; /* rays: of each texel */
} outcome;

/* A floor that holds all penumbrae and little else, or the side of the walls for AO; its texels are as wide
 * as tall. */
static void make_floor(const stage *s, int32_t width, int32_t height, quad *q) {
    make_quad(q, 0.0f, 0.0f, 1.0f, 1.0f);
    const double half = HEIGHT * WIDE * 1.6, end = s->shape == DISC ? 1.0 : -0.01,
                 begin = s->shape == DISC ? 0.0 : -1.0;
    const double low[2] = {!s->ao             ? -half
                           : s->shape == SLIT ? -1.49
                                              : begin,
                           s->ao ? begin : -half},
                 high[2] = {s->ao ? end : half, s->ao ? end : half};
    for (size_t v = 0; v < 4; ++v) {
        const double u = (double)q->uvs[2 * v], w = (double)q->uvs[2 * v + 1];
        q->positions[3 * v] = (float)(low[0] + (high[0] - low[0]) * u);
        q->positions[3 * v + 1] = 0.0f;
        q->positions[3 * v + 2] = (float)((double)height / width * (high[1] + (low[1] - high[1]) * w));
    }
}

static float values[MOST_TEXELS], deviations[MOST_TEXELS], normals[3 * MOST_TEXELS], found[MOST_TEXELS],
    truth[MOST_TEXELS];
static double places[3 * MOST_TEXELS];

static outcome try(const stage *s, const trial *t) {
    quad floor;
    make_floor(s, t->width, t->height, &floor);
    vsh_lightmap_options options = size_of(t->width, t->height, 1);
    options.shade.rays = 0;
    options.shade.method = s->ao ? VSH_SHADOW_CONE : t->method;
    options.shade.ao_method = s->ao ? t->method : VSH_AO_CONES;
    options.shade.sampler = t->sampler;
    options.shade.max_error = t->max_error;
    options.shade.ao_distance = s->shape == DISC ? 100.0 : DISTANCE;
    options.shade.start_offset = 0.0;
    options.ao_spacing = vsh_lightmap_options_default().ao_spacing;
    const vsh_light light = sun((double[]){0.0, 1.0, 0.0}, 2.0 * atan(WIDE));
    const vsh_occluders casters = {.field = s->field,
                                   .triangles = s->triangles,
                                   .true_triangles = t->lightmap && t->held ? s->triangles : NULL};
    OWNED(vsh_charts) *charts = charts_from(&floor.mesh, 1, &options);
    OWNED(texel_list) *texels = texels_from(charts);
    const texel_samples all = samples_of(texels);
    outcome o = {0};
    if (t->lightmap) {
        vsh_bake_error errors[2] = {{0}};
        float *const shadow = values;
        const vsh_lightmap lightmap = {.shadow = s->ao ? NULL : &shadow, .ao = s->ao ? values : NULL};
        vsh_bake_stats stats = vsh_bake_stats_zero();
        stats.errors = errors;
        assert_ok(vsh_bake_lightmap(&casters, charts, s->ao ? NULL : &light, s->ao ? 0 : 1, &options.shade,
                                    NULL, &lightmap, &stats, &failure));
        o.claimed = vsh_bake_error_rmse(&errors[0]);
        o.rays = (double)stats.shade.rays / (double)all.count;
    } else {
        vsh_shade_stats stats = vsh_shade_stats_zero();
        for (size_t i = 0; i < all.count; ++i) {
            memcpy(places + 3 * i, all.positions + 3 * (i * 40503u % all.count), 3 * sizeof *places);
            normals[3 * i + 1] = 1.0f;
        }
        const vsh_points points = {all.count, places, normals, NULL};
        assert_ok(s->ao ? vsh_shade_ao(&casters, &points, &options.shade, NULL, values, deviations, NULL,
                                       &stats, &failure)
                        : vsh_shade_shadow(&casters, &points, &light, &options.shade, NULL, values,
                                           deviations, &stats, &failure));
        o.claimed = sqrt(stats.square_error / (double)all.count);
        double sum = 0.0;
        for (size_t i = 0; i < all.count; ++i) {
            sum += (double)deviations[i] * (double)deviations[i];
        }
        assert_less(fabs(stats.square_error - sum), 1e-4 * sum + 1e-9);
    }
    for (size_t i = 0; i < all.count; ++i) {
        const double *p = (t->lightmap ? all.positions : places) + 3 * i;
        truth[i] = (float)truth_at(s, p[0], p[2]);
        found[i] = values[t->lightmap ? vsh_texel_place(all.texels[i], t->width) : i];
    }
    const truth_metrics m = truth_compare(all.count, found, truth, NULL);
    o.measured = m.rmse;
    o.worst = m.max;
    return o;
}

/* Counts and prints claims that fail. */
static int judge(const stage *s, const trial *t, const outcome *o) {
    /* rays on a field leave the displacement of its voxels, which is claimed: here 0.006 at most; white noise
     * has 16384 rays, which leave 0.004 */
    const double least = t->held ? 0.006 : t->sampler == VSH_SAMPLER_WHITE ? 0.004 : 0.0;
    const bool claimed = o->claimed >= 0.9 * o->measured, kept = o->measured <= fmax(t->max_error, least);
    if (!claimed || !kept) {
        print_message("%s of %s %s, %s, %s of %d x %d, asked %g: %.5f, claimed %.5f\n",
                      s->ao ? "AO" : "shadow", NAMES[s->shape],
                      vsh_get_name(s->ao ? VSH_NAMES_AO : VSH_NAMES_SHADOW, t->method),
                      vsh_get_name(VSH_NAMES_SAMPLER, t->sampler), t->lightmap ? "lightmap" : "points",
                      t->width, t->height, t->max_error, o->measured, o->claimed);
    }
    return !claimed + !kept;
}

/* By one sampler: points, a lightmap whose penumbrae are many texels wide, and one of few. */
static int try_all(const stage *s, bool exact, int32_t sampler, double max_error) {
    static const int32_t sizes[3][2] = {{48, 48}, {256, 16}, {64, 64}};
    const bool many = exact && max_error < (sampler == VSH_SAMPLER_WHITE ? 0.02 : 0.004); /* rays */
    const int32_t shadow = exact ? VSH_SHADOW_EXACT : VSH_SHADOW_ADAPTIVE,
                  ao = exact ? VSH_AO_EXACT : VSH_AO_ADAPTIVE;
    int wrong = 0;
    /* points do not know how far voxels displace them */
    for (int where = exact ? 0 : 1; where < 3; ++where) {
        const trial t = {.method = s->ao ? ao : shadow,
                         .sampler = sampler,
                         .max_error = max_error,
                         .width = sizes[where][0] / (many ? 2 : 1),
                         .height = sizes[where][1] / (many ? 2 : 1),
                         .lightmap = where > 0,
                         .held = !exact};
        const outcome o = try(s, &t);
        wrong += judge(s, &t, &o);
    }
    return wrong;
}

static const double ASKED[] = {0.05, 0.02, 0.01, 0.005, 0.002, 0.001};

/* Errors of ASKED up to `last`, in stages of every shape. */
static int claims(bool ao, bool exact, int32_t sampler, int last) {
    const int deep =
        sampler == VSH_SAMPLER_WHITE ? 3 : 5; /* smaller errors take thousands of rays: one shape only */
    int wrong = 0;
    for (int shape = 0; shape < SHAPES; ++shape) {
        if (shape == DISC && !exact) {
            continue; /* round edges of a field are not the circle's */
        }
        FREED_BY(free_stage) stage *s = make_stage(shape, ao, 0.0625);
        for (int e = 0; e <= last && (e < deep || shape == SLIT); ++e) {
            wrong += try_all(s, exact, sampler, ASKED[e]);
        }
    }
    return wrong;
}

TEST(exact_reports_its_error_and_keeps_the_requested_one) {
    for (int ao = 0; ao < 2; ++ao) {
        assert_int_equal(claims(ao, true, VSH_SAMPLER_SOBOL, 5), 0);
    }
}

/* Blue noise is replaced by Sobol's sequence if the error asked for is 0.01 or less. */
TEST(white_and_blue_noise_report_their_error) {
    for (int ao = 0; ao < 2; ++ao) {
        assert_int_equal(claims(ao, true, VSH_SAMPLER_WHITE, 3), 0);
        assert_int_equal(claims(ao, true, VSH_SAMPLER_BLUE, 1), 0);
    }
    FREED_BY(free_stage) stage *s = make_stage(EDGE, false, 0.0625);
    trial t = {.method = VSH_SHADOW_EXACT, .max_error = 0.01, .width = 64, .height = 8, .lightmap = true};
    t.sampler = VSH_SAMPLER_SOBOL;
    const outcome sobol = try(s, &t);
    t.sampler = VSH_SAMPLER_BLUE;
    const outcome blue = try(s, &t);
    assert_memory_equal(&sobol, &blue, sizeof sobol);
}

TEST(adaptive_on_a_field_of_flat_faces_reports_its_error) {
    for (int ao = 0; ao < 2; ++ao) {
        assert_int_equal(claims(ao, false, VSH_SAMPLER_SOBOL, 4), 0);
    }
}

/* All of a point's first rays may miss what hides a small part of a wide sun. */
TEST(the_report_includes_casters_that_few_rays_miss) {
    const double before = WIDE;
    WIDE = 0.45;
    int wrong = 0;
    for (int k = 0; k < 2; ++k) {
        FREED_BY(free_stage) stage *s = make_stage(k == 0 ? SLIT : DISC, false, 0.0625);
        trial t = {.method = VSH_SHADOW_EXACT, .max_error = k == 0 ? 0.05 : 0.02, .width = 48, .height = 48};
        for (int lightmap = 0; lightmap < 2; ++lightmap) {
            t.lightmap = lightmap != 0;
            const outcome o = try(s, &t);
            wrong += judge(s, &t, &o);
        }
    }
    WIDE = before;
    assert_int_equal(wrong, 0);
}

/* At the ends of a penumbra nearly all rays agree: there the light's last hundredth was lost. */
TEST(ends_of_penumbrae_do_not_collapse) {
    FREED_BY(free_stage) stage *s = make_stage(EDGE, false, 0.0625);
    const trial t = {
        .method = VSH_SHADOW_EXACT, .max_error = 0.005, .width = 256, .height = 32, .lightmap = true};
    const outcome o = try(s, &t);
    assert_true(o.worst < 0.025 && o.rays < 200.0);
}
