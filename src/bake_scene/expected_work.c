/* What rows of a lightmap are expected to take: samples are counted, and a few of them shaded coarsely tell
 * how many of them are invalid, half lit or half open, which is what rays are spent on. What is marched is
 * counted instead, in the few: cones, and walks over heights and through spheres, take as much whatever the
 * error, and differ by where they are.
 *
 * Weights are nanoseconds or so, fitted to the cloister, a terrain, a room and a level of many objects at a
 * max_error of 0.02; only what they are of each other matters. A ray takes up to three times as long in one
 * place as in another. Of what tells of it and costs nothing, that is how many triangles the texels are of:
 * where there are many, shapes are small, and so are boxes in the tree. */
#include "bake_scene/shares.h"

#include "bake/part.h"
#include "bake_scene/work.h"
#include "base/memory.h"
#include "base/try.h"
#include "shade/rays_expected.h"

#include <math.h>
#include <stdlib.h>

/* AO whose rays texels share: of p (1 - p), of what it changes by from texel to texel, where nothing tells of
 * that, in a light's penumbra, which lies where shapes are; and of a texel at the end of a chart, which
 * shoots rays of its own. */
static const double HALF_OPEN = 3500.0, CHANGING = 11000.0, LONE = 2800.0, SHAPED = 8000.0, EDGE = 1600.0;
/* What rays of AO take more where rows of tiles have so many triangles a texel, for each doubling. */
static const double CROWDED = 0.38, FEW_TRIANGLES = 0.01;
/* AO of each texel's own rays, and of p (1 - p). */
static const double ALONE = 4000.0, ALONE_HALF_OPEN = 8000.0;
/* Time of a march, and of one of its samples. */
static const double MARCH = 250.0, SAMPLE = 10.0;
/* What AO on a field takes of a texel that shares it, though nothing hides anything. */
static const double FREE = 400.0;
/* The least error that is asked of the few. */
static const double COARSE = 0.1;

/* The few texels of a lightmap, shaded. */
typedef struct shaded {
    size_t width, height, light_count;
    int32_t step;
    uint32_t *known;
    float *ao;       /* NULL: none */
    float *shadow;   /* [light_count][height][width] */
    double finer;    /* how many times as much rays take to the error asked for */
    double openings; /* times that what is open is shaded */
    double free;     /* FREE, where it is a field that is shot at */
    bool shares;
    bool lights_by_rays, open_by_rays; /* rays that max_error tells the number of */
    vshi_row_work *work;               /* [2][height / VSHI_TILE]: of each row of the few */
} shaded;

static bool is_valid(uint32_t known) {
    return (known & VSHI_PART_SHADEABLE) != 0;
}

/* By what AO changes from texel to texel, as far as its neighbours in the row tell. */
static double changing(const shaded *s, size_t i) {
    const size_t column = i % s->width;
    double least = INFINITY;
    for (int k = 0; k < 2; ++k) {
        const size_t next = k == 0 ? i - 1 : i + 1;
        if ((k == 0 ? column > 0 : column + 1 < s->width) && s->known[next] == s->known[i]) {
            least = fmin(least, fabs((double)s->ao[next] - (double)s->ao[i]) / s->step);
        }
    }
    return least < INFINITY ? CHANGING * least : LONE;
}

/* log2, straight between powers of two: of the same bits everywhere. */
static double doublings(double x) {
    double count = 0.0;
    for (; x >= 2.0; x *= 0.5) {
        count += 1.0;
    }
    return count + x - 1.0;
}

static double crowding(const vshi_share_row *row) {
    const double texels = row->samples > 0 ? row->samples : 1.0;
    return 1.0 + CROWDED * doublings(1.0 + row->triangles / (FEW_TRIANGLES * texels));
}

/* What a texel takes: but for AO, and of that. */
static void add_work(const shaded *s, size_t i, double *other, double *open) {
    static const double FULL = 0.99;
    *other += VSHI_LAID_OUT;
    if (!is_valid(s->known[i])) {
        return;
    }
    *other += VSHI_VALID;
    bool shaped = false;
    for (size_t k = 0; k < s->light_count; ++k) {
        const double v = (double)s->shadow[k * s->width * s->height + i];
        const bool in_penumbra = v > 1.0 - FULL && v < FULL;
        *other += VSHI_LIT + (in_penumbra && s->lights_by_rays ? s->finer * VSHI_PENUMBRA : 0.0);
        shaped = shaped || in_penumbra;
    }
    if (s->ao != NULL && s->open_by_rays) {
        const double p = (double)s->ao[i], half = p * (1.0 - p);
        *open += s->openings * s->free;
        *open += s->openings * s->finer *
                 (s->shares ? HALF_OPEN * half + changing(s, i) + (shaped ? SHAPED : 0.0)
                            : ALONE + ALONE_HALF_OPEN * half);
    }
}

/* Sums of a row of the few, or of all; `marched` is of what is open. */
typedef struct sums {
    double count, valid, other, open, marched;
} sums;

static double marched(const vshi_row_work *work) {
    return MARCH * (double)work->marches + SAMPLE * (double)work->samples;
}

static sums sum_rows(const shaded *s, size_t begin, size_t end) {
    sums of = {0.0, 0.0, 0.0, 0.0, 0.0};
    for (size_t row = begin; row < end; ++row) {
        of.other += marched(&s->work[row]);
        of.marched += marched(&s->work[s->height / VSHI_TILE + row]);
    }
    const size_t tile = VSHI_TILE * s->width;
    for (size_t i = begin * tile; i < end * tile; ++i) {
        if ((s->known[i] & VSHI_PART_MESH) != 0) {
            of.count += 1.0;
            of.valid += is_valid(s->known[i]);
            add_work(s, i, &of.other, &of.open);
        }
    }
    return of;
}

/* By the few in each row, or where there are none by all. */
static void weigh(const shaded *s, vshi_share_rows *share) {
    const size_t rows = s->height / VSHI_TILE;
    const sums all = sum_rows(s, 0, rows);
    const double edge = s->ao != NULL && s->open_by_rays && s->shares ? s->openings * s->finer * EDGE : 0.0;
    for (size_t row = 0; row < share->count; ++row) {
        const vshi_share_row *of = &share->row[row];
        const size_t at = VSHI_TILE * row / (size_t)s->step;
        sums few = at < rows ? sum_rows(s, at, at + 1) : all;
        few = few.count > 0.0 ? few : all;
        if (few.count == 0.0) {
            few = (sums){1.0, 1.0, VSHI_LAID_OUT + VSHI_VALID, 0.0, 0.0};
        }
        const double part = of->samples / few.count;
        const double open = part * few.open + of->edges * edge * few.valid / few.count;
        share->work[row] = (uint64_t)(part * (few.other + few.marched) + crowding(of) * open);
        share->all += share->work[row];
    }
}

static vsh_result shade(const vsh_bake_job *job, const vshi_share_rows *share, const vsh_run *run, shaded *s,
                        vsh_error *error) {
    const vsh_scene *scene = &job->scene;
    const size_t texels = s->width * s->height;
    float **planes = NULL;
    vsh_shade_options options = scene->shade;
    options.max_error = fmax(options.max_error, COARSE);
    vsh_run quiet = *run;
    quiet.progress = NULL;
    quiet.warning = NULL;
    vsh_result result;
    VSHI_TRY_DONE(
        vshi_allocate((void **)&s->work, s->height / VSHI_TILE, 2 * sizeof *s->work, "shares", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&s->known, texels, sizeof *s->known, "shares", error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&s->ao, s->openings > 0.0 ? texels : 0, sizeof *s->ao, "shares", error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&s->shadow, texels, s->light_count * sizeof *s->shadow, "shares", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&planes, s->light_count, sizeof *planes, "shares", error));
    for (size_t i = 0; i < s->light_count; ++i) {
        planes[i] = s->shadow + i * texels;
    }
    const vsh_lightmap lightmap = {.shadow = s->light_count > 0 ? planes : NULL, .ao = s->ao};
    result = vshi_bake_part(job->occluders, share->few, scene->lights, s->light_count, &options, &quiet,
                            &lightmap, s->known, NULL, s->work, NULL, error);
done:
    free(planes);
    return result;
}

/* Finds the methods that cast rays. */
static void set_methods(const vsh_bake_job *job, shaded *s) {
    const vsh_occluders *occluders = job->occluders;
    const vsh_scene *scene = &job->scene;
    const int32_t traced = occluders->triangles != NULL;
    const bool shot = traced || job->report.occluders.voxel_size > 0.0;
    const uint32_t lights = vsh_shadow_method_traits(vsh_shadow_method_resolve(scene->shade.method, traced));
    const uint32_t open = vsh_ao_method_traits(vsh_ao_method_resolve(scene->shade.ao_method, traced));
    s->lights_by_rays = shot && (lights & VSH_METHOD_KEEPS_ERROR) != 0;
    s->open_by_rays = shot && (open & VSH_METHOD_KEEPS_ERROR) != 0;
    s->free = s->shares && !traced ? FREE : 0.0;
}

vsh_result vshi_shares_weigh(const vsh_bake_job *job, vshi_share_rows *share, const vsh_run *run,
                             vsh_error *error) {
    const vsh_scene *scene = &job->scene;
    shaded s = {.light_count = scene->light_count,
                .step = share->few_step,
                .finer = vshi_rays_expected(scene->shade.max_error),
                .openings = vshi_work_openings(scene),
                .shares = share->spacing > 1};
    set_methods(job, &s);
    share->all = 0;
    if (share->few != NULL) {
        s.width = (size_t)share->few->info.width;
        s.height = (size_t)share->few->info.height;
    }
    const vsh_result result = share->few != NULL ? shade(job, share, run, &s, error) : VSH_OK;
    if (result == VSH_OK) {
        weigh(&s, share);
    }
    free(s.work);
    free(s.shadow);
    free(s.ao);
    free(s.known);
    return result;
}
