/* vdbshade compare: compares a bake with its golden one, and explains the differences: in lines, as JSON, as
 * JUnit's XML for a CI, and as a page with pictures. */
#include "compare.h"
#include "base/clock.h"
#include "base/text.h"

#include <png.h>

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

/* Draws golden, new and difference as HTML, to be freed. */
static char *draw_pictures(const vsh_channel_comparison *channel, const vsh_compared *compared) {
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

/* --- comparing */

/* Draws a channel. Channels before it that were not measured get no picture. */
static int32_t draw(void *user, size_t index, const vsh_channel_comparison *channel,
                    const vsh_compared *compared) {
    cli_comparison *c = user;
    c->pictures = realloc(c->pictures, (index + 1) * sizeof *c->pictures);
    while (c->picture_count < index) {
        c->pictures[c->picture_count++] = NULL;
    }
    c->pictures[c->picture_count++] = draw_pictures(channel, compared);
    return 0;
}

int cli_comparison_make(const cli_compare_settings *settings, const char *golden, const char *fresh,
                        cli_comparison *c) {
    *c = (cli_comparison){.golden = strdup(golden), .fresh = strdup(fresh)};
    vsh_compare_files_options wanted = settings->options;
    wanted.padding = settings->padding;
    wanted.look = settings->html != NULL ? draw : NULL;
    wanted.user = c;
    CLI_TRY(cli_check(vsh_compare_files(golden, fresh, &wanted, &cli_run, &c->made, &cli_error)));
    c->alike = vsh_comparison_alike(c->made) != 0;
    return CLI_OK;
}

const char *cli_comparison_problem(const cli_comparison *c, size_t index) {
    return c->problem == NULL ? vsh_comparison_problem(c->made, index) : index == 0 ? c->problem : NULL;
}

void cli_comparison_free(cli_comparison *c) {
    for (size_t i = 0; i < c->picture_count; ++i) {
        free(c->pictures[i]);
    }
    free(c->pictures);
    vsh_comparison_free(c->made);
    free(c->golden);
    free(c->fresh);
    memset(c, 0, sizeof *c);
}

/* --- words */

/* Joins two texts, each of which may be empty. */
static const char *join(const char *first, const char *separator, const char *second) {
    return *first == '\0'    ? second
           : *second == '\0' ? first
                             : cli_keep_text("%s%s%s", first, separator, second);
}

/* Finds the texel or voxel of a value. */
static void find_position(const vsh_channel_comparison *channel, uint64_t index, int32_t position[3]) {
    for (int axis = 0; axis < 3; ++axis) {
        const uint64_t size = axis < 2 ? (uint64_t)channel->size[axis] : UINT64_MAX;
        position[axis] = (int32_t)(index % size) + channel->origin[axis];
        index /= size;
    }
}

static bool is_flat(const vsh_channel_comparison *channel) {
    return channel->size[2] == 1 && channel->origin[2] == 0;
}

/* Formats a position, "(3, 4)". */
static const char *place(const vsh_channel_comparison *channel, uint64_t index) {
    int32_t at[3];
    find_position(channel, index, at);
    return is_flat(channel) ? cli_keep_text("(%d, %d)", at[0], at[1])
                            : cli_keep_text("(%d, %d, %d)", at[0], at[1], at[2]);
}

static const char *texel(const vsh_channel_comparison *channel) {
    return is_flat(channel) ? "texel" : "voxel";
}

static const char *explain_nonfinite(const vsh_channel_comparison *channel) {
    static const char *const names[] = {"golden", "new"};
    const vsh_measures *m = &channel->measures;
    const char *text = "";
    for (int i = 0; i < 2; ++i) {
        if (m->nonfinite[i] > 0) {
            text = join(text, ", ",
                        cli_keep_text("%" PRIu64 " %s value%s NaN or infinite, the first at %s",
                                      m->nonfinite[i], names[i], m->nonfinite[i] == 1 ? " is" : "s are",
                                      place(channel, m->nonfinite_first[i])));
        }
    }
    return text;
}

static const char *explain_region(const vsh_channel_comparison *channel, const vsh_region *region,
                                  double limit, const char *caster) {
    const uint32_t others = UINT32_C(1) << VSH_MEASURE_SHIFT | UINT32_C(1) << VSH_MEASURE_PENUMBRA;
    return cli_keep_text(
        "%" PRIu64 " %ss around %s got %s by up to %.2f with nothing like it nearby%s (limit %g)",
        region->count, texel(channel), place(channel, region->worst), region->by > 0.0 ? "lighter" : "darker",
        fabs(region->by), (channel->failed & others) == 0 ? caster : "", limit);
}

static const char *explain_measure(const vsh_channel_comparison *channel, int measure) {
    const vsh_measures *m = &channel->measures;
    const double limit = channel->limits.value[measure];
    switch (measure) {
    case VSH_MEASURE_NONFINITE:
        return explain_nonfinite(channel);
    case VSH_MEASURE_LOST:
        return explain_region(channel, &m->lost, limit, ": a lost caster?");
    case VSH_MEASURE_GAINED:
        return explain_region(channel, &m->gained, limit, ": a new caster?");
    case VSH_MEASURE_SHIFT:
        return cli_keep_text(
            "shifted by (%.2f, %.2f%s) %ss, which explains %.0f %% of the difference (limit %g)", m->shift[0],
            m->shift[1], channel->size[2] > 1 ? cli_keep_text(", %.2f", m->shift[2]) : "", texel(channel),
            100.0 * m->explained, limit);
    case VSH_MEASURE_PENUMBRA:
        return cli_keep_text("penumbrae %.3f times as wide, %.2f for %.2f %ss (limit ±%g %%)",
                             m->width[1] / m->width[0], m->width[1], m->width[0], texel(channel),
                             100.0 * limit);
    default:
        return cli_keep_text("%s %.3g (limit %g)", vsh_get_name(VSH_NAMES_MEASURE, measure),
                             m->value[measure], limit);
    }
}

/* Explains what is wrong with a channel, the best explanation first; "" if nothing is. */
static const char *explain(const vsh_channel_comparison *channel) {
    const char *text = "";
    if (channel->coverage_failed) {
        const vsh_coverage *c = &channel->coverage;
        text = cli_keep_text(
            "coverage differs in %" PRIu64 " %ss, %.3g of those covered, the first at %s (limit %g)",
            c->differs, texel(channel), c->share, place(channel, c->first), channel->coverage_limit);
    }
    if (channel->is_coverage) {
        return text;
    }
    if (channel->measures.count == 0) {
        text = join(text, "; ", "nothing is covered in both: nothing was compared");
        return join(text, "; ", explain_nonfinite(channel));
    }
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        text = (channel->failed >> i & 1) != 0 ? join(text, "; ", explain_measure(channel, i)) : text;
    }
    return text;
}

/* --- lines */

static void print_channel(const vsh_channel_comparison *channel) {
    const vsh_measures *m = &channel->measures;
    const double *made_to = channel->max_error;
    const char *what = explain(channel), *separator = "; ";
    printf("%s: %s%s%s", channel->name, channel->alike ? "alike" : "not alike", what[0] != '\0' ? ": " : "",
           what);
    if (channel->is_coverage) {
        printf("; %" PRIu64 " and %" PRIu64 " covered, %" PRIu64 " in one alone\n", channel->coverage.golden,
               channel->coverage.values, channel->coverage.differs);
        return;
    }
    if (channel->limits.options.noise > 0.0) {
        printf("; noise of %.3g is allowed for", channel->limits.options.noise);
        if (!isnan(made_to[0]) && !isnan(made_to[1])) {
            printf(" (made to max errors %.3g and %.3g)", made_to[0], made_to[1]);
        }
    }
    for (int i = VSH_MEASURE_NONFINITE + 1; i < VSH_MEASURE_COUNT && m->count > 0; ++i) {
        if (!isnan(m->value[i])) {
            printf("%s%s %.3g", separator, vsh_get_name(VSH_NAMES_MEASURE, i), m->value[i]);
            separator = ", ";
        }
    }
    printf("%s%s\n", m->count > 0 ? " at " : "", m->count > 0 ? place(channel, m->worst) : "");
}

void cli_comparison_print(const cli_comparison *c, const char *prefix) {
    const char *problem;
    const vsh_channel_comparison *channel;
    for (size_t i = 0; (problem = cli_comparison_problem(c, i)) != NULL; ++i) {
        printf("%snot alike: %s\n", prefix, problem);
    }
    for (size_t i = 0; (channel = vsh_comparison_channel(c->made, i)) != NULL; ++i) {
        fputs(prefix, stdout);
        print_channel(channel);
    }
}

/* --- JSON */

static json_t *position(const vsh_channel_comparison *channel, uint64_t index) {
    int32_t at[3];
    find_position(channel, index, at);
    return json_pack("[i,i,i]", at[0], at[1], at[2]);
}

static json_t *corner(const vsh_channel_comparison *c, const int32_t at[3]) {
    return json_pack("[i,i,i]", at[0] + c->origin[0], at[1] + c->origin[1], at[2] + c->origin[2]);
}

static json_t *region(const vsh_channel_comparison *channel, const vsh_region *r) {
    return r->count == 0 ? json_null()
                         : json_pack("{s:I,s:o,s:f,s:o,s:o}", "texels", (json_int_t)r->count, "worst",
                                     position(channel, r->worst), "by", r->by, "min", corner(channel, r->min),
                                     "max", corner(channel, r->max));
}

static json_t *nonfinite(const vsh_channel_comparison *channel, int which) {
    const vsh_measures *m = &channel->measures;
    return json_pack("{s:I,s:o}", "count", (json_int_t)m->nonfinite[which], "first",
                     m->nonfinite[which] > 0 ? position(channel, m->nonfinite_first[which]) : json_null());
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
    return json_pack("{s:{s:o,s:f,s:f},s:I,s:{s:o,s:o},s:[f,f,f],s:f,s:o,s:o}", "worst", "at",
                     position(channel, m->worst), "golden", m->worst_value[0], "new", m->worst_value[1],
                     "edges", (json_int_t)m->pairs, "penumbra_width", "golden", cli_number_json(m->width[0]),
                     "new", cli_number_json(m->width[1]), "shift", m->shift[0], m->shift[1], m->shift[2],
                     "shift_explains", m->explained, "lost", region(channel, &m->lost), "gained",
                     region(channel, &m->gained));
}

static json_t *describe(const vsh_channel_comparison *channel) {
    const vsh_coverage *c = &channel->coverage;
    json_t *root = json_pack("{s:o,s:b,s:o}", "name", cli_utf8_json(channel->name), "alike", channel->alike,
                             "what", cli_utf8_json(explain(channel)));
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

static void write_case(FILE *out, const cli_comparison *c, const char *name, const char *failure) {
    cli_write(out, "    <testcase classname=\"", name_of(c), "\"");
    cli_write(out, " name=\"", name, failure[0] == '\0' ? "\"/>\n" : "\">\n");
    if (failure[0] != '\0') {
        cli_write(out, "      <failure message=\"", failure, "\"/>\n    </testcase>\n");
    }
}

static void write_junit(FILE *out, const cli_compare_settings *s, const cli_comparison *comparisons,
                        size_t count) {
    size_t tests = 0, failures = 0;
    for (size_t i = 0; i < count; ++i) {
        tests += count_tests(&comparisons[i], &failures);
    }
    fprintf(out,
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites tests=\"%zu\" failures=\"%zu\" "
            "time=\"%.3f\">\n",
            tests, failures, vshi_seconds() - s->began);
    for (size_t i = 0; i < count; ++i) {
        const cli_comparison *c = &comparisons[i];
        failures = 0;
        tests = count_tests(c, &failures);
        cli_write(out, "  <testsuite name=\"", name_of(c), "\"");
        fprintf(out, " tests=\"%zu\" failures=\"%zu\" errors=\"0\">\n", tests, failures);
        const char *problem;
        const vsh_channel_comparison *channel;
        const char *text = "";
        for (size_t k = 0; (problem = cli_comparison_problem(c, k)) != NULL; ++k) {
            text = join(text, "; ", problem);
        }
        write_case(out, c, "files", text);
        for (size_t k = 0; (channel = vsh_comparison_channel(c->made, k)) != NULL; ++k) {
            write_case(out, c, channel->name, explain(channel));
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

/* Writes the title, the numbers of passed and failed comparisons, and the time. */
static void write_summary(FILE *out, const cli_compare_settings *s, const cli_comparison *comparisons,
                          size_t count) {
    size_t passed = 0;
    for (size_t i = 0; i < count; ++i) {
        passed += comparisons[i].alike;
    }
    cli_write(out, "<title>", s->title, "</title>\n");
    cli_write(out, "<h1>", s->title, "</h1>\n<p><b class=\"good\">");
    fprintf(out, "%zu passed</b>, <b class=\"%s\">%zu failed</b> in %.1f s</p>\n", passed,
            passed < count ? "bad" : "good", count - passed, vshi_seconds() - s->began);
}

static void write_measures(FILE *out, const vsh_channel_comparison *channel) {
    const vsh_measures *m = &channel->measures;
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
            m->count, m->range, m->worst_value[1], m->worst_value[0], place(channel, m->worst));
    if (m->pairs > 0) {
        fprintf(out, " Penumbrae are %.2f texels wide for %.2f (10 %% to 90 %%, mean of %" PRIu64 " edges).",
                m->width[1], m->width[0], m->pairs);
    }
    fputs("</p>\n", out);
}

static void write_channel(FILE *out, const vsh_channel_comparison *channel, const char *pictures) {
    cli_write(out, "<h3>", channel->name, ": ");
    fprintf(out, "%s</h3>\n", verdict(channel->alike));
    if (explain(channel)[0] != '\0') {
        cli_write(out, "<p>", explain(channel), "</p>\n");
    }
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

static void write_comparison(FILE *out, const cli_comparison *c) {
    cli_write(out, "<h2>", name_of(c), ": ");
    fprintf(out, "%s</h2>\n", verdict(c->alike));
    if (c->golden != NULL && c->fresh != NULL) {
        cli_write(out, "<p>Golden: <code>", c->golden, "</code>");
        cli_write(out, ", new: <code>", c->fresh, "</code></p>\n");
    }
    const char *problem;
    for (size_t k = 0; (problem = cli_comparison_problem(c, k)) != NULL; ++k) {
        cli_write(out, "<p class=\"bad\">", problem, "</p>\n");
    }
    const vsh_channel_comparison *channel;
    for (int alike = 0; alike < 2; ++alike) { /* failures first */
        for (size_t k = 0; (channel = vsh_comparison_channel(c->made, k)) != NULL; ++k) {
            if ((channel->alike != 0) == alike) {
                write_channel(out, channel, k < c->picture_count ? c->pictures[k] : NULL);
            }
        }
    }
}

static void write_page(FILE *out, const cli_compare_settings *s, const cli_comparison *comparisons,
                       size_t count) {
    fputs(head, out);
    write_summary(out, s, comparisons, count);
    for (size_t i = 0; i < 2 * count; ++i) { /* failures first */
        if (comparisons[i % count].alike == (i >= count)) {
            write_comparison(out, &comparisons[i % count]);
        }
    }
    fprintf(out,
            "<p>Grey-blue texels are not compared. docs/pipeline.md explains the measures. Made by vdbshade "
            "%s.</p>\n</html>\n",
            vsh_version());
}

int cli_comparison_report(const cli_compare_settings *s, const cli_comparison *comparisons, size_t count) {
    const char *const paths[] = {s->junit, s->html};
    for (size_t i = 0; i < CLI_COUNT(paths); ++i) {
        cli_temporary report;
        if (paths[i] != NULL) {
            CLI_TRY(cli_temporary_begin(&report, paths[i]));
            (i == 0 ? write_junit : write_page)(report.file, s, comparisons, count);
            CLI_TRY(cli_temporary_commit(&report));
        }
    }
    return CLI_OK;
}

/* --- the command */

static const cli_option options[] = {
    CLI_COMPARE_OPTIONS("limits, also for single channels (GOLDEN.tolerance.json if it exists)"),
    CLI_COMMON_OPTIONS,
};

static int compare_main(int argc, char **argv) {
    cli_compare_settings s = {.options = vsh_compare_files_options_default(), .began = vshi_seconds()};
    const char *files[2];
    CLI_TRY(cli_parse(&cli_compare, argc, argv, &s, files));
    s.title = cli_keep_text("%s and %s", files[0], files[1]);
    const char *const reports[] = {s.junit, s.html};
    int code;
    cli_comparison comparison = {.alike = false};
    CLI_TRY_DONE(cli_check_outputs(reports, 2, files, 2, NULL));
    cli_signals_watch();
    CLI_TRY_DONE(cli_comparison_make(&s, files[0], files[1], &comparison));
    CLI_TRY_DONE(cli_comparison_report(&s, &comparison, 1));
    if (s.json) {
        cli_write_json(NULL, cli_comparison_json(&comparison));
    } else if (!cli_given.quiet) {
        cli_comparison_print(&comparison, "");
    }
    code = comparison.alike ? CLI_OK : CLI_UNLIKE;
    cli_signals_end(code);
done:
    cli_comparison_free(&comparison);
    return code;
}

const cli_command cli_compare = {
    "compare", "GOLDEN NEW [options]", "differences between a bake and its golden one",
    "Compares two images channel by channel, or two .vdb files grid by grid, over the texels that both\n"
    "cover: values, widths of penumbrae, displacement, lost shadows. Prints one line a channel. Ends with\n"
    "0 if they are alike, and with 1 if not, or if size, channels, voxels or format differ. For the\n"
    "measures see docs/pipeline.md. Numbers in brackets are defaults.",
    CLI_ENDING(options, compare_main)};
