/* Comparisons as files for others: JUnit's XML for a CI, and a page to look at. */
#include "cli/document.h"
#include "comparison.h"

#include <inttypes.h>
#include <math.h>
#include <vdbshade/compare.h>

typedef struct all {
    const cli_comparison *comparisons;
    size_t count;
} all;

static const char *name_of(const cli_comparison *c) {
    return c->name != NULL ? c->name : c->golden;
}

/* --- JUnit (the schema of Ant's and Jenkins' reports) */

/* A test of the files, and one of each channel. */
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
    fputs("    <testcase classname=\"", out);
    cli_document_escape(out, name_of(c));
    fputs("\" name=\"", out);
    cli_document_escape(out, name);
    if (failure[0] == '\0') {
        fputs("\"/>\n", out);
        return;
    }
    fputs("\">\n      <failure message=\"", out);
    cli_document_escape(out, failure);
    fputs("\"/>\n    </testcase>\n", out);
}

static void write_junit(FILE *out, const void *user) {
    const all *a = user;
    size_t tests = 0, failures = 0;
    for (size_t i = 0; i < a->count; ++i) {
        tests += count_tests(&a->comparisons[i], &failures);
    }
    fprintf(out, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites tests=\"%zu\" failures=\"%zu\">\n",
            tests, failures);
    for (size_t i = 0; i < a->count; ++i) {
        const cli_comparison *c = &a->comparisons[i];
        fputs("  <testsuite name=\"", out);
        cli_document_escape(out, name_of(c));
        failures = 0;
        tests = count_tests(c, &failures);
        fprintf(out, "\" tests=\"%zu\" failures=\"%zu\" errors=\"0\">\n", tests, failures);
        const char *problem;
        const vsh_channel_comparison *channel;
        char text[2048];
        size_t used = 0;
        text[0] = '\0';
        for (size_t k = 0; (problem = cli_comparison_problem(c, k)) != NULL && used < sizeof text; ++k) {
            used += (size_t)snprintf(text + used, sizeof text - used, "%s%s", k > 0 ? "; " : "", problem);
        }
        write_case(out, c, "files", text);
        for (size_t k = 0; (channel = vsh_comparison_channel(c->made, k)) != NULL; ++k) {
            cli_channel_explain(channel, text, sizeof text);
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
    "body{font:15px/1.5 system-ui,sans-serif;margin:1.5em auto;max-width:1200px;padding:0 1em;color:#111;"
    "background:#fff;overflow-wrap:break-word}\n"
    "h2{margin-top:2em}h2,h3{line-height:1.25}.good{color:#186a3b}.bad{color:#b00020}\n"
    ".three{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,280px),1fr));gap:1em}\n"
    "figure{margin:0;font-size:13px}img{image-rendering:pixelated;outline:1px solid "
    "#ddd;width:100%;height:auto}\n"
    ".scale{height:10px;margin:.3em 0 0}.ends{display:flex;justify-content:space-between;"
    "font-variant-numeric:tabular-nums}\n"
    ".wide{overflow-x:auto}table{border-collapse:collapse;font-size:13px;margin:1em 0}"
    "th,td{padding:.25em .7em;text-align:right;border-bottom:1px solid #e4e4e4;white-space:nowrap;"
    "font-variant-numeric:tabular-nums}\n"
    "td:first-child,th:first-child{text-align:left}td.bad{font-weight:600}code{font:13px "
    "ui-monospace,monospace}\n"
    "</style>\n";

static const char *verdict(bool alike) {
    return alike ? "<span class=\"good\">alike</span>" : "<span class=\"bad\">not alike</span>";
}

static void write_measures(FILE *out, const vsh_channel_comparison *channel) {
    const vsh_measures *m = &channel->measures;
    fputs("<div class=\"wide\"><table><tr><th>measure</th>", out);
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        fprintf(out, "<th>%s</th>", vsh_measure_name(i));
    }
    fputs("</tr>\n<tr><td>value</td>", out);
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        fprintf(out, "<td%s>", (channel->failed >> i & 1) != 0 ? " class=\"bad\"" : "");
        fprintf(out, isnan(m->value[i]) ? "–</td>" : "%.4g</td>", m->value[i]);
    }
    fputs("</tr>\n<tr><td>limit</td>", out);
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        const double limit = i == VSH_MEASURE_NONFINITE ? 0.0 : channel->limits.value[i];
        fprintf(out, "<td>%s %g</td>", vsh_measure_at_least(i) ? "≥" : "≤", limit);
    }
    fputs("</tr></table></div>\n", out);
    char place[64];
    fprintf(out, "<p>%" PRIu64 " values compared, in units of %g. Largest difference: %.6g for %.6g at %s.",
            m->count, m->range, m->worst_value[1], m->worst_value[0],
            cli_channel_place(channel, m->worst, place));
    if (m->pairs > 0) {
        fprintf(out,
                " Penumbrae are %.2f wide for %.2f (10 %% to 90 %%, mean of %" PRIu64
                " edges; golden has %" PRIu64 ", new %" PRIu64 ").",
                m->width[1], m->width[0], m->pairs, m->edges[0], m->edges[1]);
    }
    fputs("</p>\n", out);
}

static void write_channel(FILE *out, const vsh_channel_comparison *channel, const char *pictures) {
    char what[2048];
    cli_channel_explain(channel, what, sizeof what);
    fputs("<h3>", out);
    cli_document_escape(out, channel->name);
    fprintf(out, ": %s</h3>\n", verdict(channel->alike));
    if (what[0] != '\0') {
        fputs("<p>", out);
        cli_document_escape(out, what);
        fputs("</p>\n", out);
    }
    if (channel->is_coverage) {
        fprintf(out,
                "<p>Coverage: %" PRIu64 " texels in golden, %" PRIu64 " in new, %" PRIu64
                " in one alone.</p>\n",
                channel->coverage.golden, channel->coverage.values, channel->coverage.differs);
        return;
    }
    fputs(pictures != NULL ? pictures : "", out);
    if (channel->measures.count > 0) {
        write_measures(out, channel);
    }
}

static void write_page(FILE *out, const void *user) {
    const all *a = user;
    fputs(head, out);
    fputs("<title>vdbshade: golden and new</title>\n<h1>Golden and new</h1>\n", out);
    for (size_t i = 0; i < a->count; ++i) {
        const cli_comparison *c = &a->comparisons[i];
        fputs("<h2>", out);
        cli_document_escape(out, name_of(c));
        fprintf(out, ": %s</h2>\n<p>", verdict(c->alike));
        if (c->golden != NULL && c->fresh != NULL) {
            fputs("Golden: <code>", out);
            cli_document_escape(out, c->golden);
            fputs("</code>, new: <code>", out);
            cli_document_escape(out, c->fresh);
            fputs("</code>", out);
        }
        fputs("</p>\n", out);
        const char *problem;
        for (size_t k = 0; (problem = cli_comparison_problem(c, k)) != NULL; ++k) {
            fputs("<p class=\"bad\">", out);
            cli_document_escape(out, problem);
            fputs("</p>\n", out);
        }
        const vsh_channel_comparison *channel;
        for (size_t k = 0; (channel = vsh_comparison_channel(c->made, k)) != NULL; ++k) {
            write_channel(out, channel, k < c->picture_count ? c->pictures[k] : NULL);
        }
    }
    fprintf(
        out,
        "<p>Grey-blue is not compared. What the measures are stands in docs/regression.md. Made by vdbshade "
        "%s.</p>\n</html>\n",
        vsh_version());
}

int cli_comparison_report(const cli_compare_settings *s, const cli_comparison *comparisons, size_t count) {
    const all a = {comparisons, count};
    int code = 0;
    if (s->junit != NULL) {
        code = cli_document_write(s->junit, write_junit, &a);
    }
    return code == 0 && s->html != NULL ? cli_document_write(s->html, write_page, &a) : code;
}
