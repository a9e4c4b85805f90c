/* A comparison in words. */
#include "comparison.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>

/* By what names a fault best: a bake that is shifted changes nearly every measure, but one says so; penumbrae
 * that got narrower darken and lighten regions too, without any caster. */
static const int by_meaning[] = {
    VSH_MEASURE_NONFINITE, VSH_MEASURE_SHIFT, VSH_MEASURE_PENUMBRA, VSH_MEASURE_LOST, VSH_MEASURE_GAINED,
    VSH_MEASURE_WIDTHS,    VSH_MEASURE_EDGES, VSH_MEASURE_SSIM,     VSH_MEASURE_BIAS, VSH_MEASURE_RMSE,
    VSH_MEASURE_P99,       VSH_MEASURE_SHARE, VSH_MEASURE_MAX};

typedef struct text {
    char *at;
    size_t left;
} text;

static void __attribute__((format(printf, 2, 3))) add(text *t, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(t->at, t->left, format, arguments);
    va_end(arguments);
    const size_t used = length < 0 ? 0 : (size_t)length < t->left ? (size_t)length : t->left - 1;
    t->at += used;
    t->left -= used;
}

const char *cli_channel_place(const vsh_channel_comparison *channel, uint64_t index, char place[64]) {
    const uint64_t width = (uint64_t)channel->size[0], height = (uint64_t)channel->size[1];
    const int64_t x = (int64_t)(index % width) + channel->origin[0];
    const int64_t y = (int64_t)(index / width % height) + channel->origin[1];
    const int64_t z = (int64_t)(index / width / height) + channel->origin[2];
    if (channel->size[2] == 1 && channel->origin[2] == 0) {
        snprintf(place, 64, "(%" PRId64 ", %" PRId64 ")", x, y);
    } else {
        snprintf(place, 64, "(%" PRId64 ", %" PRId64 ", %" PRId64 ")", x, y, z);
    }
    return place;
}

static const char *texel(const vsh_channel_comparison *channel) {
    return channel->size[2] == 1 && channel->origin[2] == 0 ? "texel" : "voxel";
}

static void add_nonfinite(text *t, const vsh_channel_comparison *channel) {
    const vsh_measures *m = &channel->measures;
    char place[64];
    for (int which = 0; which < 2; ++which) {
        if (m->nonfinite[which] > 0) {
            add(t, "%s%" PRIu64 " %s value%s NaN or infinite, the first at %s",
                which > 0 && m->nonfinite[0] > 0 ? ", " : "", m->nonfinite[which],
                which == 0 ? "golden" : "new", m->nonfinite[which] == 1 ? " is" : "s are",
                cli_channel_place(channel, m->nonfinite_first[which], place));
        }
    }
}

static void add_region(text *t, const vsh_channel_comparison *channel, const vsh_region *region, double limit,
                       const char *caster) {
    const uint32_t others = UINT32_C(1) << VSH_MEASURE_SHIFT | UINT32_C(1) << VSH_MEASURE_PENUMBRA;
    char place[64];
    add(t, "%" PRIu64 " %ss around %s got %s by up to %.2f with nothing like it nearby%s (limit %g)",
        region->count, texel(channel), cli_channel_place(channel, region->worst, place),
        region->by > 0.0 ? "lighter" : "darker", fabs(region->by),
        (channel->failed & others) == 0 ? caster : "", limit);
}

static void add_shift(text *t, const vsh_channel_comparison *channel) {
    const vsh_measures *m = &channel->measures;
    add(t, "shifted by (%.2f, %.2f", m->shift[0], m->shift[1]);
    if (channel->size[2] > 1) {
        add(t, ", %.2f", m->shift[2]);
    }
    add(t, ") %ss, which explains %.0f %% of the difference (limit %g)", texel(channel), 100.0 * m->explained,
        channel->limits.value[VSH_MEASURE_SHIFT]);
}

static void add_penumbra(text *t, const vsh_channel_comparison *channel) {
    const vsh_measures *m = &channel->measures;
    add(t, "penumbrae %.3f times as wide, %.2f for %.2f %ss (limit ±%g %%)", m->width[1] / m->width[0],
        m->width[1], m->width[0], texel(channel), 100.0 * channel->limits.value[VSH_MEASURE_PENUMBRA]);
}

static void add_failure(text *t, const vsh_channel_comparison *channel, int measure) {
    const vsh_measures *m = &channel->measures;
    const double limit = channel->limits.value[measure];
    switch (measure) {
    case VSH_MEASURE_NONFINITE:
        add_nonfinite(t, channel);
        break;
    case VSH_MEASURE_LOST:
        add_region(t, channel, &m->lost, limit, ": a lost caster?");
        break;
    case VSH_MEASURE_GAINED:
        add_region(t, channel, &m->gained, limit, ": a new caster?");
        break;
    case VSH_MEASURE_SHIFT:
        add_shift(t, channel);
        break;
    case VSH_MEASURE_PENUMBRA:
        add_penumbra(t, channel);
        break;
    default:
        add(t, "%s %.3g (limit %g)", vsh_measure_name(measure), m->value[measure], limit);
    }
}

/* Names noise or a curve that explains most of the difference. */
static void add_causes(text *t, const vsh_channel_comparison *channel) {
    const vsh_measures *m = &channel->measures;
    if (m->curve[2][0] > 0.0) {
        add(t, "values follow a curve that takes %.2f, %.2f, %.2f to %.2f, %.2f, %.2f: gamma or exposure?",
            m->curve[0][0], m->curve[1][0], m->curve[2][0], m->curve[0][1], m->curve[1][1], m->curve[2][1]);
    } else if (m->noise_share >= 0.5 && m->noise > channel->limits.options.noise) {
        add(t, "noise of %.3g, which is %.0f %% of the squared difference", m->noise, 100.0 * m->noise_share);
    }
}

void cli_channel_explain(const vsh_channel_comparison *channel, char *out, size_t capacity) {
    text t = {out, capacity};
    out[0] = '\0';
    if (channel->coverage_failed) {
        const vsh_coverage *c = &channel->coverage;
        char place[64];
        add(&t, "coverage differs in %" PRIu64 " %ss, %.3g of those covered, the first at %s (limit %g)",
            c->differs, texel(channel), c->share, cli_channel_place(channel, c->first, place),
            channel->coverage_limit);
    }
    if (channel->is_coverage) {
        return;
    }
    if (channel->measures.count == 0) {
        add(&t, "%snothing is covered in both: nothing was compared", out[0] != '\0' ? "; " : "");
        if (channel->measures.nonfinite[0] + channel->measures.nonfinite[1] > 0) {
            add(&t, "; ");
            add_nonfinite(&t, channel);
        }
        return;
    }
    if (channel->failed != 0) {
        add_causes(&t, channel);
    }
    for (size_t i = 0; i < sizeof by_meaning / sizeof by_meaning[0]; ++i) {
        if ((channel->failed >> by_meaning[i] & 1) != 0) {
            add(&t, "%s", out[0] != '\0' ? "; " : "");
            add_failure(&t, channel, by_meaning[i]);
        }
    }
}

/* --- lines */

static void print_measures(FILE *out, const vsh_channel_comparison *channel) {
    const vsh_measures *m = &channel->measures;
    char place[64];
    fprintf(out, "; rmse %.3g, bias %+.2g, max %.3g at %s, p99 %.3g, share %.3g, ssim %.5g",
            m->value[VSH_MEASURE_RMSE], m->bias, m->value[VSH_MEASURE_MAX],
            cli_channel_place(channel, m->worst, place), m->value[VSH_MEASURE_P99],
            m->value[VSH_MEASURE_SHARE], m->value[VSH_MEASURE_SSIM]);
    if (m->pairs > 0) {
        fprintf(out, ", penumbrae %.2f and %.2f (%" PRIu64 " edges", m->width[0], m->width[1], m->pairs);
        /* of too few edges nothing is measured */
        if (!isnan(m->value[VSH_MEASURE_WIDTHS])) {
            fprintf(out, ", %.3g off", m->value[VSH_MEASURE_WIDTHS]);
        }
        if (!isnan(m->value[VSH_MEASURE_EDGES])) {
            fprintf(out, ", %.3g unpaired", m->value[VSH_MEASURE_EDGES]);
        }
        fputc(')', out);
    }
    fprintf(out, ", shift %.2f, lost %" PRIu64 ", gained %" PRIu64, m->value[VSH_MEASURE_SHIFT],
            m->lost.count, m->gained.count);
}

static void print_noise(FILE *out, const vsh_channel_comparison *channel) {
    const double *made_to = channel->max_error;
    fprintf(out, "; noise of %.3g is allowed for", channel->limits.options.noise);
    if (!isnan(made_to[0]) && !isnan(made_to[1])) {
        fprintf(out, " (made to max errors %.3g and %.3g)", made_to[0], made_to[1]);
    }
}

static void print_channel(FILE *out, const vsh_channel_comparison *channel) {
    char what[2048];
    cli_channel_explain(channel, what, sizeof what);
    fprintf(out, "%s: %s%s%s", channel->name, channel->alike ? "alike" : "not alike",
            what[0] != '\0' ? ": " : "", what);
    if (!channel->is_coverage && channel->limits.options.noise > 0.0) {
        print_noise(out, channel);
    }
    if (channel->is_coverage) {
        fprintf(out, "; %" PRIu64 " and %" PRIu64 " covered, %" PRIu64 " in one alone",
                channel->coverage.golden, channel->coverage.values, channel->coverage.differs);
    } else if (channel->measures.count > 0) {
        print_measures(out, channel);
    }
}

void cli_comparison_print(FILE *out, const cli_comparison *c, const char *prefix) {
    const char *problem;
    const vsh_channel_comparison *channel;
    for (size_t i = 0; (problem = cli_comparison_problem(c, i)) != NULL; ++i) {
        fprintf(out, "%snot alike: %s\n", prefix, problem);
    }
    for (size_t i = 0; (channel = vsh_comparison_channel(c->made, i)) != NULL; ++i) {
        fputs(prefix, out);
        print_channel(out, channel);
        fputc('\n', out);
    }
}
