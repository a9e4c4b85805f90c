/* Small pictures of truth, bake and difference. */
#include "cli/document.h"
#include "trade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { THUMB = 160, MOST_RECEIVERS = 3 };

static const uint8_t not_measured[3] = {0xd3, 0xdb, 0xe6}; /* no shade of grey, and in no difference */

/* Of 0 … 1: grey; or of a difference white in the middle, red where too light, blue where too dark. */
static void colour(double value, bool difference, uint8_t rgb[3]) {
    const uint8_t shade = (uint8_t)lround(254.0 * fmin(1.0, fmax(0.0, value)));
    const uint8_t rest = difference ? (uint8_t)(255 - 2 * abs(shade - 127)) : shade;
    rgb[0] = difference && shade >= 127 ? 255 : rest;
    rgb[1] = rest;
    rgb[2] = difference && shade < 127 ? 255 : rest;
}

typedef struct picture {
    const trade_work *work;
    const trade_receiver *receiver;
    int width, height;
} picture;

/* Means of a plane's measured texels, or of their differences from `from`, as colours. */
static void shrink(const picture *p, const float *plane, const float *from, uint8_t *pixels) {
    const size_t wide = (size_t)p->receiver->info.width, high = (size_t)p->receiver->info.height;
    const size_t width = (size_t)p->width, height = (size_t)p->height, first = p->receiver->first;
    for (size_t row = 0; row < height; ++row) {
        for (size_t column = 0; column < width; ++column) {
            double sum = 0.0, count = 0.0;
            for (size_t y = row * high / height; y < (row + 1) * high / height; ++y) {
                for (size_t x = column * wide / width; x < (column + 1) * wide / width; ++x) {
                    const size_t texel = first + y * wide + x;
                    if (p->work->common[texel]) {
                        sum += (double)plane[texel] - (from != NULL ? (double)from[texel] : 0.0);
                        ++count;
                    }
                }
            }
            /* a difference of an eighth is all red, or all blue */
            const double value = from != NULL ? 0.5 + 4.0 * (sum / count) : sum / count;
            uint8_t *rgb = pixels + 3 * (row * width + column);
            if (count > 0.0) {
                colour(value, from != NULL, rgb);
            } else {
                memcpy(rgb, not_measured, sizeof not_measured);
            }
        }
    }
}

/* The first light's plane, or AO, at one receiver. */
static void write_pictures(FILE *out, const trade_work *work, const trade_subject *subject,
                           const trade_run *run, const trade_receiver *receiver) {
    uint8_t values[THUMB * THUMB * 3];
    const int longest =
        receiver->info.width > receiver->info.height ? receiver->info.width : receiver->info.height;
    const int most = longest < THUMB ? longest : THUMB;
    const picture p = {work, receiver, (int)fmax(1.0, (double)receiver->info.width * most / longest),
                       (int)fmax(1.0, (double)receiver->info.height * most / longest)};
    const struct {
        const float *plane, *from;
        const char *what;
    } shown[] = {{subject->truth, NULL, "truth"},
                 {run->values, NULL, "bake"},
                 {run->values, subject->truth, "difference"}};
    fputs("<div>", out);
    for (size_t i = 0; i < sizeof shown / sizeof shown[0]; ++i) {
        shrink(&p, shown[i].plane, shown[i].from, values);
        fprintf(out, "%s<img alt=\"%s\" width=\"%d\" height=\"%d\" src=\"data:image/png;base64,",
                i > 0 ? " " : "", shown[i].what, p.width, p.height);
        const cli_pixels pixels = {p.width, p.height, 3, values};
        (void)cli_document_png(out, work->settings->report, &pixels); /* the page does without */
        fputs("\">", out);
    }
    fputs("</div>", out);
}

/* The front in the order of time: no two of its runs take the same. */
static const trade_run *next_on_front(const trade_subject *subject, const trade_run *last) {
    const trade_run *next = NULL;
    for (size_t i = 0; i < subject->run_count; ++i) {
        const trade_run *run = &subject->runs[i];
        if (run->front && (last == NULL || run->rate > last->rate) &&
            (next == NULL || run->rate < next->rate)) {
            next = run;
        }
    }
    return next;
}

void trade_thumbnails_write(FILE *out, const trade_work *work, const trade_subject *subject) {
    const size_t shown = work->receiver_count < MOST_RECEIVERS ? work->receiver_count : MOST_RECEIVERS;
    if (subject->planes > 1) {
        fprintf(out, " Shown is the first of %zu lights.", subject->planes);
    }
    if (shown < work->receiver_count) {
        fprintf(out, " Shown are the first %zu of %zu receivers.", shown, work->receiver_count);
    }
    fputs("</p>\n<div class=\"shots\">\n", out);
    const trade_run *last = NULL;
    for (const trade_run *run; (run = next_on_front(subject, last)) != NULL; last = run) {
        fputs("<figure>", out);
        for (size_t r = 0; r < shown; ++r) {
            write_pictures(out, work, subject, run, &work->receivers[r]);
        }
        fputs("<figcaption>", out);
        trade_options_write(out, run->options);
        fprintf(out, "<br>RMSE %.4f, %.3g µs a value</figcaption></figure>\n", run->metrics.rmse, run->rate);
    }
    fputs("</div>\n", out);
}
