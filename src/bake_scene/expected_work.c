/* What rows of a lightmap are expected to take: samples are counted, and a few of them shaded coarsely tell
 * how many of them are invalid, half lit or half open, which is what rays are spent on.
 *
 * Weights are nanoseconds or so, fitted to the cloister, a terrain, a room and a level of many objects at a
 * max_error of 0.02; only what they are of each other matters. A ray takes up to three times as long in one
 * place as in another. Of what tells of it and costs nothing, that is how many triangles the texels are of:
 * where there are many, shapes are small, and so are boxes in the tree. */
#include "bake_scene/shares.h"

#include "bake/part.h"
#include "base/memory.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>

/* A sample's position and whether it is valid; what a valid one takes beside rays. */
static const double LAID_OUT = 250.0, VALID = 200.0;
/* A light that is proved, or dark; one in its penumbra. */
static const double LIT = 100.0, PENUMBRA = 6000.0;
/* AO whose rays texels share: of p (1 - p), of what it changes by from texel to texel, where nothing tells of
 * that, in a light's penumbra, which lies where shapes are; and of a texel at the end of a chart, which
 * shoots rays of its own. */
static const double HALF_OPEN = 3500.0, CHANGING = 11000.0, LONE = 2800.0, SHAPED = 8000.0, EDGE = 1600.0;
/* What rays of AO take more where rows of tiles have so many triangles a texel, for each doubling. */
static const double CROWDED = 0.38, FEW_TRIANGLES = 0.01;
/* AO of each texel's own rays, and of p (1 - p). */
static const double ALONE = 4000.0, ALONE_HALF_OPEN = 8000.0;
/* The error that these are of, and the least that is asked of the few. */
static const double COMMON = 0.02, COARSE = 0.1;
/* Where nothing was looked at yet: texels in a penumbra, and AO of a texel that shares it or has its own,
 * rather too little. */
static const double USUAL_PENUMBRA = 0.05, USUAL_SHARED = 1050.0, USUAL_ALONE = 5000.0;
/* What rays take more where they are marched, rather too much than too little. */
static const double MARCHED = 25.0;
/* What a border costs, in rows for each texel of spacing between those that share AO, and where it is
 * interpolated instead; and what all borders may take. */
static const double SHARED_ROWS = 1.5, MARCHED_ROWS = 2.5, MOST_BORDERS = 0.1;

/* The few texels of a lightmap, shaded. */
typedef struct shaded {
    size_t width, height, light_count;
    int32_t step;
    uint32_t *known;
    float *ao;       /* NULL: none */
    float *shadow;   /* [light_count][height][width] */
    double finer;    /* what rays take more for a smaller error than COMMON */
    double openings; /* times that what is open is shaded */
    bool shares;
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
    *other += LAID_OUT;
    if (!is_valid(s->known[i])) {
        return;
    }
    *other += VALID;
    bool shaped = false;
    for (size_t k = 0; k < s->light_count; ++k) {
        const double v = (double)s->shadow[k * s->width * s->height + i];
        const bool in_penumbra = v > 1.0 - FULL && v < FULL;
        *other += LIT + (in_penumbra ? s->finer * PENUMBRA : 0.0);
        shaped = shaped || in_penumbra;
    }
    if (s->ao != NULL) {
        const double p = (double)s->ao[i], half = p * (1.0 - p);
        *open += s->openings * s->finer *
                 (s->shares ? HALF_OPEN * half + changing(s, i) + (shaped ? SHAPED : 0.0)
                            : ALONE + ALONE_HALF_OPEN * half);
    }
}

/* Sums of a row of the few, or of all. */
typedef struct sums {
    double count, valid, other, open;
} sums;

static sums sum_rows(const shaded *s, size_t begin, size_t end) {
    sums of = {0.0, 0.0, 0.0, 0.0};
    for (size_t i = begin * s->width; i < end * s->width; ++i) {
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
    const sums all = sum_rows(s, 0, s->height);
    const double edge = s->ao != NULL && s->shares ? s->openings * s->finer * EDGE : 0.0;
    for (size_t row = 0; row < share->count; ++row) {
        const vshi_share_row *of = &share->row[row];
        const size_t at = VSHI_TILE * row / (size_t)s->step;
        sums few = at < s->height ? sum_rows(s, at, at + 1) : all;
        few = few.count > 0.0 ? few : all;
        if (few.count == 0.0) {
            few = (sums){1.0, 1.0, LAID_OUT + VALID, 0.0};
        }
        const double part = of->samples / few.count;
        const double open = part * few.open + of->edges * edge * few.valid / few.count;
        share->work[row] = (uint64_t)(part * few.other + crowding(of) * open);
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
                            &lightmap, s->known, NULL, NULL, error);
done:
    free(planes);
    return result;
}

/* --- of what a scene asks for */

/* What rays take more for a smaller error than COMMON. */
static double finer_of(const vsh_scene *scene) {
    const double finer = COMMON / fmax(scene->shade.max_error, 1e-4);
    return finer > 1.0 ? finer * sqrt(finer) : finer;
}

/* Times that what is open is shaded. */
static double openings_of(const vsh_scene *scene) {
    return (scene->ao ? 1.0 : 0.0) + vsh_planes_shaded(&scene->planes);
}

/* Whether its size is what it says. */
static bool is_sized(const vsh_receiver *receiver) {
    return receiver->atlas != VSH_ATLAS_OBJECTS && receiver->texels_per_unit == 0.0 && receiver->pages <= 1 &&
           receiver->max_size == 0 && receiver->width > 0 && receiver->height > 0;
}

/* Whether something is not traced against triangles of meshes. */
static bool is_marched(const vsh_scene *scene) {
    bool marched = vsh_scene_marches(scene, NULL) != 0;
    for (size_t i = 0; i < scene->layer_count; ++i) {
        marched = marched || vsh_scene_marches(scene, &scene->layers[i]) != 0;
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        marched = marched || scene->casters[i].type != VSH_CASTER_MESH;
    }
    return marched;
}

double vshi_shares_most(const vsh_scene *scene, double least) {
    const bool marched = is_marched(scene);
    const double finer = finer_of(scene) * (marched ? MARCHED : 1.0), openings = openings_of(scene);
    const double lights = (double)scene->light_count * (LIT + USUAL_PENUMBRA * finer * PENUMBRA);
    double ns = 0.0, borders = 0.0;
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        const vsh_receiver *receiver = &scene->receivers[i];
        if (!is_sized(receiver)) {
            return INFINITY;
        }
        const double across = receiver->supersample;
        const double points = (double)receiver->width * receiver->height * across * across;
        const bool shares = openings > 0.0 && receiver->supersample == 1 && receiver->ao_spacing > 1;
        const double border = shares ? (marched ? MARCHED_ROWS : SHARED_ROWS) * receiver->ao_spacing : 1.0;
        ns += points * (LAID_OUT + VALID + lights + openings * finer * (shares ? USUAL_SHARED : USUAL_ALONE));
        borders += MOST_BORDERS * receiver->height / border;
    }
    return fmin(1e-9 * ns / least, 1.0 + borders);
}

vsh_result vshi_shares_weigh(const vsh_bake_job *job, vshi_share_rows *share, const vsh_run *run,
                             vsh_error *error) {
    const vsh_scene *scene = &job->scene;
    shaded s = {.light_count = scene->light_count,
                .step = share->few_step,
                .finer = finer_of(scene),
                .openings = openings_of(scene),
                .shares = share->spacing > 1};
    share->all = 0;
    if (share->few != NULL) {
        s.width = (size_t)share->few->info.width;
        s.height = (size_t)share->few->info.height;
    }
    const vsh_result result = share->few != NULL ? shade(job, share, run, &s, error) : VSH_OK;
    if (result == VSH_OK) {
        weigh(&s, share);
    }
    free(s.shadow);
    free(s.ao);
    free(s.known);
    return result;
}
