/* Golden, new and difference of a channel, as pictures that stand in the page itself. */
#include "cli/document.h"
#include "cli/message.h"
#include "comparison.h"

#include <math.h>
#include <stdlib.h>

enum { LONGEST = 512 }; /* texels along a side of a picture: larger ones are shrunk */

static const float nothing[3] = {0.83f, 0.86f, 0.90f}; /* what is not compared: no shade of grey */

/* A slice of the planes, and how it is shrunk. */
typedef struct view {
    const vsh_compared *compared;
    size_t first;          /* of the slice */
    int32_t width, height; /* of the picture */
    double least, most;    /* of golden values: black and white */
    double full;           /* difference that is all red, or all blue */
} view;

static bool shown(const view *v, size_t at) {
    const vsh_compared *c = v->compared;
    return (c->mask == NULL || c->mask[at] != 0) && isfinite(c->golden[at]) && isfinite(c->values[at]);
}

enum { GOLDEN, FRESH, DIFFERENCE, PICTURES };

/* Mean of the values that a pixel shows; of differences the largest, so that none is lost by shrinking. */
static bool take(const view *v, int what, int32_t px, int32_t py, double *value) {
    const vsh_compared *c = v->compared;
    const size_t w = (size_t)c->size[0], h = (size_t)c->size[1];
    const size_t x0 = (size_t)px * w / (size_t)v->width, x1 = ((size_t)px + 1) * w / (size_t)v->width;
    const size_t y0 = (size_t)py * h / (size_t)v->height, y1 = ((size_t)py + 1) * h / (size_t)v->height;
    double sum = 0.0, count = 0.0, largest = 0.0;
    for (size_t y = y0; y < y1; ++y) {
        for (size_t x = x0; x < x1; ++x) {
            const size_t at = v->first + y * w + x;
            if (shown(v, at)) {
                const double difference = (double)c->values[at] - (double)c->golden[at];
                largest = fabs(difference) > fabs(largest) ? difference : largest;
                sum += what == GOLDEN ? (double)c->golden[at] : (double)c->values[at];
                count += 1.0;
            }
        }
    }
    *value = what == DIFFERENCE ? largest : count > 0.0 ? sum / count : 0.0;
    return count > 0.0;
}

static float between(double value) {
    return (float)fmin(1.0, fmax(0.0, value));
}

/* Grey, or white where there is no difference, red where new is lighter, blue where it is darker. */
static void colour(const view *v, int what, double value, float rgb[3]) {
    if (what != DIFFERENCE) {
        rgb[0] = rgb[1] = rgb[2] = between((value - v->least) / (v->most - v->least));
        return;
    }
    const float off = between(fabs(value) / v->full);
    rgb[0] = value > 0.0 ? 1.0f : 1.0f - off;
    rgb[1] = 1.0f - off;
    rgb[2] = value > 0.0 ? 1.0f - off : 1.0f;
}

static int write_picture(FILE *out, const char *page, const view *v, int what) {
    const size_t count = (size_t)v->width * (size_t)v->height;
    uint8_t *values = malloc(3 * count);
    if (values == NULL) {
        return cli_out_of_memory(page);
    }
    for (size_t i = 0; i < count; ++i) {
        double value;
        float rgb[3] = {nothing[0], nothing[1], nothing[2]};
        if (take(v, what, (int32_t)(i % (size_t)v->width), (int32_t)(i / (size_t)v->width), &value)) {
            colour(v, what, value, rgb);
        }
        for (size_t k = 0; k < 3; ++k) {
            values[3 * i + k] = (uint8_t)lround(255.0 * (double)rgb[k]);
        }
    }
    const cli_pixels pixels = {v->width, v->height, 3, values};
    const int code = cli_document_png(out, page, &pixels);
    free(values);
    return code;
}

/* The scale of greys, from 0 to 1 where that is what there is; and of differences, up to a round number. */
static void set_scales(view *v, const vsh_channel_comparison *channel) {
    const vsh_compared *c = v->compared;
    const size_t count = (size_t)c->size[0] * (size_t)c->size[1] * (size_t)c->size[2];
    v->least = 0.0;
    v->most = 1.0;
    for (size_t i = 0; i < count; ++i) {
        if (shown(v, i)) {
            v->least = fmin(v->least, (double)c->golden[i]);
            v->most = fmax(v->most, (double)c->golden[i]);
        }
    }
    /* at the 99th percentile, but no less than what is a hundredth of the range */
    const vsh_measures *m = &channel->measures;
    const double wanted = m->count > 0 ? m->range * fmax(0.01, m->value[VSH_MEASURE_P99]) : 1.0;
    const double power = pow(10.0, floor(log10(wanted)));
    v->full = wanted <= power         ? power
              : wanted <= 2.0 * power ? 2.0 * power
              : wanted <= 5.0 * power ? 5.0 * power
                                      : 10.0 * power;
}

static void write_scale(FILE *out, const view *v, int what) {
    if (what == DIFFERENCE) {
        fprintf(out,
                "<div class=\"scale\" style=\"background:linear-gradient(90deg,#00f,#fff,#f00)\"></div><div "
                "class=\"ends\"><span>−%g, darker</span><span>0</span><span>lighter, +%g</span></div>",
                v->full, v->full);
    } else {
        fprintf(out,
                "<div class=\"scale\" style=\"background:linear-gradient(90deg,#000,#fff)\"></div><div "
                "class=\"ends\"><span>%g</span><span>%g</span></div>",
                v->least, v->most);
    }
}

char *cli_comparison_pictures(const char *page, const vsh_channel_comparison *channel,
                              const vsh_compared *compared) {
    static const char *const what[PICTURES] = {"golden", "new", "difference"};
    const int32_t w = compared->size[0], h = compared->size[1], longest = w > h ? w : h;
    const int32_t most = longest < LONGEST ? longest : LONGEST;
    view v = {.compared = compared};
    v.width = (int32_t)fmax(1.0, (double)w * most / longest);
    v.height = (int32_t)fmax(1.0, (double)h * most / longest);
    const size_t slice = (size_t)channel->measures.worst / ((size_t)w * (size_t)h);
    v.first = slice * (size_t)w * (size_t)h;
    set_scales(&v, channel);
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL) {
        cli_out_of_memory(page);
        return NULL;
    }
    if (compared->size[2] > 1) {
        fprintf(out, "<p>The slice of z = %d, where the difference is largest.</p>\n",
                (int32_t)slice + channel->origin[2]);
    }
    fputs("<div class=\"three\">\n", out);
    int code = CLI_OK;
    for (int i = 0; i < PICTURES && code == CLI_OK; ++i) {
        fprintf(out, "<figure><img alt=\"%s\" src=\"data:image/png;base64,", what[i]);
        code = write_picture(out, page, &v, i);
        fprintf(out, "\"><figcaption>%s", what[i]);
        if (i == DIFFERENCE) {
            fprintf(out, ", %.3g times", 1.0 / v.full);
        }
        write_scale(out, &v, i);
        fputs("</figcaption></figure>\n", out);
    }
    fputs("</div>\n", out);
    const bool whole = !ferror(out);
    if (fclose(out) != 0 || !whole) {
        code = cli_out_of_memory(page);
    }
    if (code != CLI_OK) {
        free(text);
        return NULL;
    }
    return text;
}
