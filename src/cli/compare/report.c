/* Reports of comparisons: JSON, JUnit's XML for a CI, and a page with pictures. */
#include "base/uri.h"
#include "cli/compare/comparison.h"
#include "cli/message.h"
#include "cli/temporary.h"

#include <inttypes.h>
#include <math.h>
#include <png.h>
#include <stdlib.h>

/* --- JSON */

static json_t *place(const vsh_channel_comparison *channel, uint64_t index) {
    int32_t at[3];
    cli_channel_position(channel, index, at);
    return json_pack("[i,i,i]", at[0], at[1], at[2]);
}

static json_t *corner(const vsh_channel_comparison *c, const int32_t at[3]) {
    return json_pack("[i,i,i]", at[0] + c->origin[0], at[1] + c->origin[1], at[2] + c->origin[2]);
}

static json_t *region(const vsh_channel_comparison *channel, const vsh_region *r) {
    return r->count == 0 ? json_null()
                         : json_pack("{s:I,s:o,s:f,s:o,s:o}", "texels", (json_int_t)r->count, "worst",
                                     place(channel, r->worst), "by", r->by, "min", corner(channel, r->min),
                                     "max", corner(channel, r->max));
}

static json_t *nonfinite(const vsh_channel_comparison *channel, int which) {
    const vsh_measures *m = &channel->measures;
    return json_pack("{s:I,s:o}", "count", (json_int_t)m->nonfinite[which], "first",
                     m->nonfinite[which] > 0 ? place(channel, m->nonfinite_first[which]) : json_null());
}

static json_t *curve(const vsh_measures *m) {
    const double(*c)[2] = m->curve;
    return c[2][0] > 0.0
               ? json_pack("[[f,f],[f,f],[f,f]]", c[0][0], c[0][1], c[1][0], c[1][1], c[2][0], c[2][1])
               : json_null();
}

static json_t *measures(const vsh_channel_comparison *channel) {
    const vsh_measures *m = &channel->measures;
    json_t *values = json_object(), *limits = json_object(), *failed = json_array();
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        const char *name = vsh_get_name(VSH_NAMES_MEASURE, i);
        json_object_set_new(values, name, cli_number_json(m->value[i]));
        json_object_set_new(limits, name, cli_number_json(channel->limits.value[i]));
        if ((channel->failed >> i & 1) != 0) {
            json_array_append_new(failed, json_string(name));
        }
    }
    return json_pack("{s:I,s:f,s:[o,o],s:f,s:o,s:o,s:o,s:o,s:o}", "compared", (json_int_t)m->count, "range",
                     m->range, "max_error", cli_number_json(channel->max_error[0]),
                     cli_number_json(channel->max_error[1]), "noise", channel->limits.options.noise, "failed",
                     failed, "measures", values, "limits", limits, "golden_nonfinite", nonfinite(channel, 0),
                     "new_nonfinite", nonfinite(channel, 1));
}

static json_t *details(const vsh_channel_comparison *channel) {
    const vsh_measures *m = &channel->measures;
    return json_pack("{s:{s:o,s:f,s:f},s:I,s:{s:o,s:o},s:[f,f,f],s:f,s:f,s:f,s:o,s:o,s:o}", "worst", "at",
                     place(channel, m->worst), "golden", m->worst_value[0], "new", m->worst_value[1], "edges",
                     (json_int_t)m->pairs, "penumbra_width", "golden", cli_number_json(m->width[0]), "new",
                     cli_number_json(m->width[1]), "shift", m->shift[0], m->shift[1], m->shift[2],
                     "shift_explains", m->explained, "measured_noise", m->noise, "noise_explains",
                     m->noise_share, "curve", curve(m), "lost", region(channel, &m->lost), "gained",
                     region(channel, &m->gained));
}

static json_t *describe(const vsh_channel_comparison *channel) {
    char what[CLI_EXPLANATION];
    const vsh_coverage *c = &channel->coverage;
    cli_channel_explain(channel, what);
    json_t *root = json_pack("{s:o,s:b,s:o}", "name", cli_utf8_json(channel->name), "alike", channel->alike,
                             "what", cli_utf8_json(what));
    if (channel->is_coverage || c->golden + c->values > 0) {
        json_object_update_new(root, json_pack("{s:{s:I,s:I,s:I,s:f,s:f}}", "coverage", "golden",
                                               (json_int_t)c->golden, "new", (json_int_t)c->values, "differs",
                                               (json_int_t)c->differs, "share", c->share, "limit",
                                               channel->coverage_limit));
    }
    if (!channel->is_coverage) {
        json_object_update_new(root, measures(channel));
    }
    if (channel->measures.count > 0) {
        json_object_update_new(root, details(channel));
    }
    return root;
}

json_t *cli_comparison_json(const cli_comparison *c) {
    json_t *problems = json_array(), *channels = json_array();
    const char *problem;
    const vsh_channel_comparison *channel;
    for (size_t i = 0; (problem = cli_comparison_problem(c, i)) != NULL; ++i) {
        json_array_append_new(problems, cli_utf8_json(problem));
    }
    for (size_t i = 0; (channel = vsh_comparison_channel(c->made, i)) != NULL; ++i) {
        json_array_append_new(channels, describe(channel));
    }
    return json_pack("{s:o,s:o,s:b,s:o,s:o}", "golden", cli_utf8_json(c->golden), "new",
                     cli_utf8_json(c->fresh), "alike", c->alike, "problems", problems, "channels", channels);
}

/* --- pictures: golden, new and difference, for the page */

enum { GOLDEN, FRESH, DIFFERENCE, PICTURES };

enum { LONGEST = 512 }; /* texels along a side of a picture: larger planes are shrunk */

/* A slice of the planes, and how it is shrunk. */
typedef struct view {
    const vsh_compared *compared;
    size_t first;         /* of the slice */
    size_t width, height; /* of the picture */
    double least, most;   /* of golden values: black and white */
    double full;          /* difference drawn in full red or blue */
} view;

static bool shown(const view *v, size_t at) {
    const vsh_compared *c = v->compared;
    return (c->mask == NULL || c->mask[at] != 0) && isfinite(c->golden[at]) && isfinite(c->values[at]);
}

/* Draws the mean of the values in a pixel, and of differences the largest, so that shrinking hides none. They
 * are white at 0, red if new is lighter, blue if it is darker. */
static void draw_pixel(const view *v, int what, size_t px, size_t py, uint8_t rgb[3]) {
    const vsh_compared *c = v->compared;
    const size_t w = (size_t)c->size[0], h = (size_t)c->size[1];
    const size_t x0 = px * w / v->width, x1 = (px + 1) * w / v->width;
    const size_t y0 = py * h / v->height, y1 = (py + 1) * h / v->height;
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
    if (count == 0.0) { /* not compared: grey-blue */
        rgb[0] = 212;
        rgb[1] = 219;
        rgb[2] = 230;
    } else if (what == DIFFERENCE) {
        rgb[0] = rgb[1] = rgb[2] = (uint8_t)lround(255.0 * fmax(0.0, 1.0 - fabs(largest) / v->full));
        rgb[largest > 0.0 ? 0 : 2] = 255;
    } else {
        const double grey = (sum / count - v->least) / (v->most - v->least);
        rgb[0] = rgb[1] = rgb[2] = (uint8_t)lround(255.0 * fmin(1.0, fmax(0.0, grey)));
    }
}

/* Writes a PNG in base64. */
static void write_picture(FILE *out, const view *v, int what) {
    uint8_t *values = malloc(3 * v->width * v->height);
    for (size_t i = 0; i < v->width * v->height; ++i) {
        draw_pixel(v, what, i % v->width, i / v->width, &values[3 * i]);
    }
    png_image image = {.version = PNG_IMAGE_VERSION,
                       .width = (png_uint_32)v->width,
                       .height = (png_uint_32)v->height,
                       .format = PNG_FORMAT_RGB};
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    uint8_t *bytes = malloc(size);
    png_image_write_to_memory(&image, bytes, &size, 0, values, 0, NULL); /* only memory could be short */
    for (size_t i = 0; i < size; i += VSHI_BASE64_BYTES) {
        char letters[VSHI_BASE64_LETTERS];
        vshi_base64_group(bytes + i, size - i < VSHI_BASE64_BYTES ? size - i : VSHI_BASE64_BYTES, letters);
        fwrite(letters, 1, sizeof letters, out);
    }
    free(bytes);
    free(values);
}

/* Greys go from 0 to 1, or as far as golden does. Differences are scaled to the 99th percentile. */
static void set_scales(view *v, const vsh_channel_comparison *channel) {
    const vsh_compared *c = v->compared;
    const vsh_measures *m = &channel->measures;
    const size_t count = (size_t)c->size[0] * (size_t)c->size[1] * (size_t)c->size[2];
    v->least = 0.0;
    v->most = 1.0;
    for (size_t i = 0; i < count; ++i) {
        if (shown(v, i)) {
            v->least = fmin(v->least, (double)c->golden[i]);
            v->most = fmax(v->most, (double)c->golden[i]);
        }
    }
    v->full = m->count > 0 ? m->range * fmax(0.01, m->value[VSH_MEASURE_P99]) : 1.0;
}

char *cli_comparison_pictures(const vsh_channel_comparison *channel, const vsh_compared *compared) {
    static const char *const what[PICTURES] = {"golden", "new", "difference"};
    const int32_t w = compared->size[0], h = compared->size[1], longest = w > h ? w : h;
    const int32_t most = longest < LONGEST ? longest : LONGEST;
    view v = {.compared = compared};
    v.width = (size_t)fmax(1.0, (double)w * most / longest);
    v.height = (size_t)fmax(1.0, (double)h * most / longest);
    const size_t slice = (size_t)channel->measures.worst / ((size_t)w * (size_t)h);
    v.first = slice * (size_t)w * (size_t)h;
    set_scales(&v, channel);
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (compared->size[2] > 1) {
        fprintf(out, "<p>The slice at z = %d has the largest difference.</p>\n",
                (int32_t)slice + channel->origin[2]);
    }
    fputs("<div class=\"three\">\n", out);
    for (int i = 0; i < PICTURES; ++i) {
        fprintf(out, "<figure><img alt=\"%s\" src=\"data:image/png;base64,", what[i]);
        write_picture(out, &v, i);
        fprintf(out, "\"><figcaption>%s, ", what[i]);
        if (i == DIFFERENCE) {
            fprintf(out, "red: lighter, blue: darker, full at ±%.2g", v.full);
        } else {
            fprintf(out, "black: %g, white: %g", v.least, v.most);
        }
        fputs("</figcaption></figure>\n", out);
    }
    fputs("</div>\n", out);
    fclose(out);
    return text;
}

static const char *name_of(const cli_comparison *c) {
    return c->name != NULL ? c->name : c->golden;
}

/* --- JUnit (the schema of Ant's and Jenkins' reports) */

/* Counts a test for the files, and one for each channel. */
static size_t count_tests(const cli_comparison *c, size_t *failures) {
    const vsh_channel_comparison *channel;
    size_t tests = 1;
    *failures += cli_comparison_problem(c, 0) != NULL;
    for (; (channel = vsh_comparison_channel(c->made, tests - 1)) != NULL; ++tests) {
        *failures += !channel->alike;
    }
    return tests;
}

/* Writes text with its special characters escaped, between markup. */
static void put(FILE *out, const char *before, const char *text, const char *after) {
    fputs(before, out);
    cli_escape(out, text);
    fputs(after, out);
}

static void write_case(FILE *out, const cli_comparison *c, const char *name, const char *failure) {
    put(out, "    <testcase classname=\"", name_of(c), "\"");
    put(out, " name=\"", name, failure[0] == '\0' ? "\"/>\n" : "\">\n");
    if (failure[0] != '\0') {
        put(out, "      <failure message=\"", failure, "\"/>\n    </testcase>\n");
    }
}

static void write_junit(FILE *out, const cli_comparison *comparisons, size_t count) {
    size_t tests = 0, failures = 0;
    for (size_t i = 0; i < count; ++i) {
        tests += count_tests(&comparisons[i], &failures);
    }
    fprintf(out, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites tests=\"%zu\" failures=\"%zu\">\n",
            tests, failures);
    for (size_t i = 0; i < count; ++i) {
        const cli_comparison *c = &comparisons[i];
        failures = 0;
        tests = count_tests(c, &failures);
        put(out, "  <testsuite name=\"", name_of(c), "\"");
        fprintf(out, " tests=\"%zu\" failures=\"%zu\" errors=\"0\">\n", tests, failures);
        const char *problem;
        const vsh_channel_comparison *channel;
        char text[CLI_EXPLANATION];
        size_t used = 0;
        text[0] = '\0';
        for (size_t k = 0; (problem = cli_comparison_problem(c, k)) != NULL && used < sizeof text; ++k) {
            used += (size_t)snprintf(text + used, sizeof text - used, "%s%s", k > 0 ? "; " : "", problem);
        }
        write_case(out, c, "files", text);
        for (size_t k = 0; (channel = vsh_comparison_channel(c->made, k)) != NULL; ++k) {
            cli_channel_explain(channel, text);
            write_case(out, c, channel->name, text);
        }
        fputs("  </testsuite>\n", out);
    }
    fputs("</testsuites>\n", out);
}

/* --- the page */

static const char head[] =
    "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n"
    "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n<style>\n"
    "body{font:15px/1.5 system-ui,sans-serif;margin:1.5em auto;max-width:1200px;padding:0 1em;"
    "overflow-wrap:break-word}\n"
    ".good{color:#186a3b}.bad{color:#b00020}figure{margin:0;font-size:13px}\n"
    ".three{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,280px),1fr));gap:1em}\n"
    "img{image-rendering:pixelated;outline:1px solid #ddd;width:100%;height:auto}\n"
    "table{font-size:13px;margin:1em 0}th,td{padding:.2em .7em;text-align:left}\n</style>\n";

static const char *verdict(bool alike) {
    return alike ? "<span class=\"good\">alike</span>" : "<span class=\"bad\">not alike</span>";
}

static void write_measures(FILE *out, const vsh_channel_comparison *channel) {
    const vsh_measures *m = &channel->measures;
    char place[64];
    fputs("<table><tr><th>measure</th><th>value</th><th>limit</th></tr>\n", out);
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        fprintf(out, "<tr><td>%s</td><td%s>", vsh_get_name(VSH_NAMES_MEASURE, i),
                (channel->failed >> i & 1) != 0 ? " class=\"bad\"" : "");
        fprintf(out, isnan(m->value[i]) ? "–" : "%.4g", m->value[i]);
        fprintf(out, "</td><td>%g</td></tr>\n", channel->limits.value[i]);
    }
    fprintf(out,
            "</table>\n<p>%" PRIu64 " values compared, in units of %g. Largest difference: %.6g for %.6g "
            "at %s.",
            m->count, m->range, m->worst_value[1], m->worst_value[0],
            cli_channel_place(channel, m->worst, place));
    if (m->pairs > 0) {
        fprintf(out, " Penumbrae are %.2f texels wide for %.2f (10 %% to 90 %%, mean of %" PRIu64 " edges).",
                m->width[1], m->width[0], m->pairs);
    }
    fputs("</p>\n", out);
}

static void write_channel(FILE *out, const vsh_channel_comparison *channel, const char *pictures) {
    char what[CLI_EXPLANATION];
    cli_channel_explain(channel, what);
    put(out, "<h3>", channel->name, ": ");
    fprintf(out, "%s</h3>\n", verdict(channel->alike));
    put(out, "<p>", what, "</p>\n");
    if (channel->is_coverage) {
        fprintf(out,
                "<p>%" PRIu64 " texels covered in golden, %" PRIu64 " in new, %" PRIu64
                " in one alone.</p>\n",
                channel->coverage.golden, channel->coverage.values, channel->coverage.differs);
        return;
    }
    fputs(pictures != NULL ? pictures : "", out);
    if (channel->measures.count > 0) {
        write_measures(out, channel);
    }
}

static void write_page(FILE *out, const cli_comparison *comparisons, size_t count) {
    fputs(head, out);
    fputs("<title>vdbshade: golden and new</title>\n<h1>Golden and new</h1>\n", out);
    for (size_t i = 0; i < count; ++i) {
        const cli_comparison *c = &comparisons[i];
        put(out, "<h2>", name_of(c), ": ");
        fprintf(out, "%s</h2>\n", verdict(c->alike));
        if (c->golden != NULL && c->fresh != NULL) {
            put(out, "<p>Golden: <code>", c->golden, "</code>");
            put(out, ", new: <code>", c->fresh, "</code></p>\n");
        }
        const char *problem;
        for (size_t k = 0; (problem = cli_comparison_problem(c, k)) != NULL; ++k) {
            put(out, "<p class=\"bad\">", problem, "</p>\n");
        }
        const vsh_channel_comparison *channel;
        for (size_t k = 0; (channel = vsh_comparison_channel(c->made, k)) != NULL; ++k) {
            write_channel(out, channel, k < c->picture_count ? c->pictures[k] : NULL);
        }
    }
    fprintf(out,
            "<p>Grey-blue texels are not compared. docs/pipeline.md explains the measures. Made by vdbshade "
            "%s.</p>\n</html>\n",
            vsh_version());
}

int cli_comparison_report(const cli_compare_settings *s, const cli_comparison *comparisons, size_t count) {
    cli_temporary report;
    if (s->junit != NULL) {
        CLI_TRY(cli_temporary_begin(&report, s->junit));
        write_junit(report.file, comparisons, count);
        CLI_TRY(cli_temporary_commit(&report));
    }
    if (s->html != NULL) {
        CLI_TRY(cli_temporary_begin(&report, s->html));
        write_page(report.file, comparisons, count);
        CLI_TRY(cli_temporary_commit(&report));
    }
    return CLI_OK;
}
