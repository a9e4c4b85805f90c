/* --view: every run on the mesh in one page, with the truth beside it. */
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/temporary.h"
#include "cli/try.h"
#include "cli/warnings.h"
#include "trade.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of planes that a page has, as it holds them, 2 bytes a texel: what browsers open without effort. */
static const double MOST_BYTES = 256.0 * 1024 * 1024;

/* Texels that values are grown by, so that lookups between texels read none that was not baked. */
enum { GROWN = 2 };

int trade_check_view(const trade_settings *s, const vsh_scene *scene) {
    if (s->view == NULL) {
        return CLI_OK;
    }
    if (!cli_has_ending(s->view, "html")) {
        return cli_usage("--view '%s': expected a name that ends in .html", s->view);
    }
    if (scene->receiver_count != 1 || scene->receivers[0].type != VSH_RECEIVER_MESH) {
        return cli_usage("--view '%s': shows one lightmap of one mesh; see --receiver", s->view);
    }
    return CLI_OK;
}

int trade_check_view_uvs(const trade_work *work) {
    const char *page = work->settings->view;
    const size_t *numbers;
    return page == NULL || vsh_assets_receiver_atlas(work->assets, 0, &numbers) == NULL
               ? CLI_OK
               : cli_usage("--view '%s': shows UVs of the mesh's file, not those that are made", page);
}

/* --- what is seen: texels that all runs have, and what is grown from them */

/* One step: each texel that has no value takes the mean of its neighbours that had one before. */
static void grow(float *plane, const uint8_t *mask, const uint8_t *grown, size_t width, size_t height) {
    for (size_t i = 0; i < width * height; ++i) {
        if (mask[i] || !grown[i]) {
            continue;
        }
        const size_t x = i % width, y = i / width;
        double sum = 0.0, count = 0.0;
        for (size_t v = y > 0 ? y - 1 : 0; v <= y + 1 && v < height; ++v) {
            for (size_t u = x > 0 ? x - 1 : 0; u <= x + 1 && u < width; ++u) {
                sum += mask[v * width + u] ? (double)plane[v * width + u] : 0.0;
                count += mask[v * width + u];
            }
        }
        plane[i] = (float)(sum / count);
    }
}

static void grow_mask(const uint8_t *mask, uint8_t *grown, size_t width, size_t height) {
    for (size_t i = 0; i < width * height; ++i) {
        const size_t x = i % width, y = i / width;
        grown[i] = 0;
        for (size_t v = y > 0 ? y - 1 : 0; v <= y + 1 && v < height; ++v) {
            for (size_t u = x > 0 ? x - 1 : 0; u <= x + 1 && u < width; ++u) {
                grown[i] = grown[i] || mask[v * width + u];
            }
        }
    }
}

/* --- the bakes of the page */

typedef struct shown {
    vsh_view_bake bake;
    vsh_image image;
    char name[256];
    const char **names; /* [planes + 1], as the next */
    const float **planes;
} shown;

typedef struct page {
    const trade_work *work;
    const float *coverage;
    char (*channels)[VSH_CHANNEL_NAME]; /* [lights] */
    shown *list;
    size_t count;
    uint8_t *mask, *grown; /* [texels] */
} page;

/* A run, or (NULL) the truth. */
static int add(page *p, const trade_subject *subject, const trade_run *run) {
    const trade_work *work = p->work;
    const char *what = subject->ao ? "AO" : "shadow";
    shown *one = &p->list[p->count];
    float *values = run != NULL ? run->values : subject->truth;
    one->names = calloc(subject->planes + 1, sizeof *one->names);
    one->planes = calloc(subject->planes + 1, sizeof *one->planes);
    ++p->count;
    if (one->names == NULL || one->planes == NULL) {
        return cli_out_of_memory("page");
    }
    for (size_t i = 0; i < subject->planes; ++i) {
        one->names[i] = subject->ao ? "ao" : p->channels[i];
        one->planes[i] = values + i * work->texels;
    }
    one->names[subject->planes] = "A";
    one->planes[subject->planes] = p->coverage;
    if (run == NULL) {
        snprintf(one->name, sizeof one->name, "%s: the truth", what);
    } else {
        snprintf(one->name, sizeof one->name, "%s: %s%s: RMSE %.4f, %.3f s", what,
                 run->embree ? "Embree, " : "", run->options, run->metrics.rmse, run->bake_s);
    }
    const vsh_charts_info *info = &work->receivers[0].info;
    one->image =
        (vsh_image){info->width, info->height, (int32_t)subject->planes + 1, one->names, one->planes, NULL};
    one->bake = vsh_view_bake_default();
    one->bake.images = &one->image;
    one->bake.image_count = 1;
    one->bake.name = one->name;
    return CLI_OK;
}

/* All runs, or those on the front where a page would be too large. */
static int add_all(page *p, bool front) {
    for (size_t s = 0; s < p->work->subject_count; ++s) {
        const trade_subject *subject = &p->work->subjects[s];
        CLI_TRY(add(p, subject, NULL));
        for (size_t i = 0; i < subject->run_count; ++i) {
            if (!front || subject->runs[i].front) {
                CLI_TRY(add(p, subject, &subject->runs[i]));
            }
        }
    }
    return CLI_OK;
}

static void grow_all(page *p) {
    const trade_work *work = p->work;
    const size_t width = (size_t)work->receivers[0].info.width;
    const size_t height = (size_t)work->receivers[0].info.height;
    for (int step = 0; step < GROWN; ++step) {
        grow_mask(p->mask, p->grown, width, height);
        for (size_t s = 0; s < work->subject_count; ++s) {
            const trade_subject *subject = &work->subjects[s];
            for (size_t k = 0; k < subject->planes; ++k) {
                grow(subject->truth + k * work->texels, p->mask, p->grown, width, height);
                for (size_t i = 0; i < subject->run_count; ++i) {
                    grow(subject->runs[i].values + k * work->texels, p->mask, p->grown, width, height);
                }
            }
        }
        memcpy(p->mask, p->grown, width * height);
    }
}

static int write_page(page *p) {
    const trade_settings *s = p->work->settings;
    const vsh_receiver *receiver = &p->work->scene->receivers[0];
    const vsh_view_bake **bakes = calloc(p->count, sizeof *bakes);
    if (bakes == NULL) {
        return cli_out_of_memory("page");
    }
    for (size_t i = 0; i < p->count; ++i) {
        bakes[i] = &p->list[i].bake;
    }
    p->list[0].bake.model = receiver->path;
    p->list[0].bake.uv_set = receiver->uv_set;
    vsh_error error;
    const vsh_result result = vsh_view_write_bakes(s->view, bakes, p->count, &p->work->run, &error);
    free(bakes);
    return result == VSH_OK ? CLI_OK : cli_fail_of(NULL, &error);
}

static int make_page(page *p, float *coverage) {
    const trade_work *work = p->work;
    size_t runs = 0;
    double bytes = 0.0;
    for (size_t s = 0; s < work->subject_count; ++s) {
        const trade_subject *subject = &work->subjects[s];
        runs += 1 + subject->run_count;
        bytes += 2.0 * (double)work->texels * (double)((1 + subject->run_count) * (1 + subject->planes));
    }
    p->list = calloc(runs, sizeof *p->list);
    p->channels = calloc(work->scene->light_count + 1, sizeof *p->channels);
    p->mask = malloc(work->texels);
    p->grown = malloc(work->texels);
    if (p->list == NULL || p->channels == NULL || p->mask == NULL || p->grown == NULL) {
        return cli_out_of_memory("page");
    }
    for (size_t i = 0; i < work->scene->light_count; ++i) {
        snprintf(p->channels[i], sizeof p->channels[i], "shadow.%.63s", work->scene->lights[i].name);
    }
    for (size_t i = 0; i < work->texels; ++i) {
        coverage[i] = work->common[i];
    }
    memcpy(p->mask, work->common, work->texels);
    if (bytes > MOST_BYTES) {
        cli_warn("%s: only the runs on the front are in it; the planes of all %zu would take %.0f MiB; "
                 "lower --size",
                 work->settings->view, runs - work->subject_count, bytes / 1048576.0);
    }
    CLI_TRY(add_all(p, bytes > MOST_BYTES));
    grow_all(p);
    return write_page(p);
}

int trade_write_view(const trade_work *work) {
    if (work->settings->view == NULL) {
        return CLI_OK;
    }
    float *coverage = calloc(work->texels, sizeof *coverage);
    page p = {.work = work, .coverage = coverage};
    const int code = coverage != NULL ? make_page(&p, coverage) : cli_out_of_memory("page");
    for (size_t i = 0; i < p.count; ++i) {
        free(p.list[i].names);
        free(p.list[i].planes);
    }
    free(p.list);
    free(p.channels);
    free(p.mask);
    free(p.grown);
    free(coverage);
    return code;
}
