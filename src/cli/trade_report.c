/* The report: one page that needs nothing beside it, and the same numbers as CSV. */
#include "message.h"
#include "signals.h"
#include "temporary.h"
#include "trade_plot.h"
#include "trade_png.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { THUMB = 128 };

static const double targets[] = {0.05, 0.02, 0.01, 0.005};

static const char head[] =
    "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n"
    "<meta name=\"viewport\" content=\"width=device-width\">\n<style>\n"
    "body{font:15px/1.45 system-ui,sans-serif;margin:2em auto;max-width:1100px;padding:0 1em;color:#111;"
    "background:#fff}\n"
    "h1,h2{line-height:1.2}h2{margin-top:2em}svg{max-width:860px;width:100%;font:12px system-ui,sans-serif}\n"
    ".grid{stroke:#e4e4e4;fill:none}.front{stroke:#111;stroke-width:1.5;stroke-dasharray:5 3;fill:none}"
    ".embree{stroke:#000;stroke-width:1;fill:none}\n"
    ".wide{overflow-x:auto}table{border-collapse:collapse;font-size:13px;white-space:nowrap}"
    "th,td{padding:.25em .6em;text-align:right;border-bottom:1px solid #e4e4e4}"
    "td:first-child,th:first-child,td.t,th.t{text-align:left}tr.f{background:#eef6f1}"
    "code{font:12px ui-monospace,monospace}img{image-rendering:pixelated;vertical-align:top}"
    "figure{display:inline-block;margin:0 1em 1em 0;font-size:12px}figcaption{max-width:410px}\n</style>\n";

static void write_escaped(FILE *out, const char *text) {
    for (; *text != '\0'; ++text) {
        switch (*text) {
        case '<':
            fputs("&lt;", out);
            break;
        case '>':
            fputs("&gt;", out);
            break;
        case '&':
            fputs("&amp;", out);
            break;
        case '"':
            fputs("&quot;", out);
            break;
        default:
            fputc(*text, out);
        }
    }
}

/* --- which options reach an error in the least time */

/* The fastest of the runs whose RMSE is at most `target`; NULL where there is none. */
static const trade_run *fastest(const trade_subject *subject, double target, bool building, bool embree) {
    const trade_run *best = NULL;
    for (size_t i = 0; i < subject->run_count; ++i) {
        const trade_run *run = &subject->runs[i];
        if (run->embree != embree || !(run->metrics.rmse <= target)) {
            continue;
        }
        const double time = run->bake_s + (building ? run->build_s : 0.0);
        const double best_time = best != NULL ? best->bake_s + (building ? best->build_s : 0.0) : INFINITY;
        best = time < best_time ? run : best;
    }
    return best;
}

static void write_targets(FILE *out, const trade_work *work, const trade_subject *subject) {
    fputs("<table><tr><th>RMSE</th><th class=\"t\">least bake time with</th><th>s for a million</th>"
          "<th>Embree alone</th><th class=\"t\">least time with building</th><th>s</th></tr>\n",
          out);
    for (size_t i = 0; i < sizeof targets / sizeof targets[0]; ++i) {
        const trade_run *bake = fastest(subject, targets[i], false, false);
        const trade_run *all = fastest(subject, targets[i], true, false);
        const trade_run *embree = fastest(subject, targets[i], false, true);
        fprintf(out, "<tr><td>%g</td>", targets[i]);
        if (bake != NULL) {
            fprintf(out, "<td class=\"t\"><code>%s</code></td><td>%.3g</td>", bake->options,
                    trade_rate(work, subject, bake));
        } else {
            fputs("<td class=\"t\">none of these</td><td>–</td>", out);
        }
        if (embree != NULL) {
            fprintf(out, "<td>%.3g (%s)</td>", trade_rate(work, subject, embree), embree->options);
        } else {
            fputs("<td>–</td>", out);
        }
        if (all != NULL) {
            fprintf(out, "<td class=\"t\"><code>%s</code></td><td>%.3g</td>", all->options,
                    all->bake_s + all->build_s);
        } else {
            fputs("<td class=\"t\">none of these</td><td>–</td>", out);
        }
        fputs("</tr>\n", out);
    }
    fputs("</table>\n", out);
}

/* --- the table */

static void write_table(FILE *out, const trade_work *work, const trade_subject *subject) {
    fputs(
        "<div class=\"wide\"><table><tr><th>options</th><th>build s</th><th>bake s</th><th>s for a million"
        "</th><th>MB</th><th>RMSE</th><th>in penumbrae</th><th>bias</th><th>p95</th><th>p99</th><th>max</th>"
        "<th>width error</th><th>certified</th></tr>\n",
        out);
    for (size_t i = 0; i < subject->run_count; ++i) {
        const trade_run *run = &subject->runs[i];
        const trade_metrics *m = &run->metrics;
        fprintf(out, "<tr%s><td>%s<code>%s</code></td><td>%.2f</td><td>%.3f</td><td>%.3g</td><td>%.1f</td>",
                run->front ? " class=\"f\"" : "", run->embree ? "Embree, " : "", run->options, run->build_s,
                run->bake_s, trade_rate(work, subject, run), (double)run->bytes / 1e6);
        fprintf(out, "<td>%.4f</td><td>%.4f</td><td>%+.4f</td><td>%.3f</td><td>%.3f</td><td>%.3f</td>",
                m->rmse, m->penumbra_rmse, m->bias, m->p95, m->p99, m->max);
        fprintf(out, isnan(m->width_error) ? "<td>–</td>" : "<td>%.1f %%</td>", 100.0 * m->width_error);
        fprintf(out, isnan(run->certified) ? "<td>–</td></tr>\n" : "<td>%.1f %%</td></tr>\n",
                100.0 * run->certified);
    }
    fputs("</table></div>\n", out);
}

/* --- thumbnails */

static void make_palettes(uint8_t gray[256][3], uint8_t difference[256][3]) {
    for (int i = 0; i < 256; ++i) {
        gray[i][0] = gray[i][1] = gray[i][2] = (uint8_t)i;
        const int off = i > 128 ? i - 128 : 128 - i; /* white in the middle, red too light, blue too dark */
        const uint8_t rest = (uint8_t)(255 - (off < 128 ? 2 * off : 255));
        difference[i][0] = i >= 128 ? 255 : rest;
        difference[i][1] = rest;
        difference[i][2] = i >= 128 ? rest : 255;
    }
}

/* Every n-th texel of a plane, or of its difference from `from`; what is not valid is grey. */
static void shrink(const trade_work *work, const float *plane, const float *from, int width, int height,
                   uint8_t *pixels) {
    for (int row = 0; row < height; ++row) {
        for (int column = 0; column < width; ++column) {
            const size_t x = (size_t)column * (size_t)work->info.width / (size_t)width;
            const size_t y = (size_t)row * (size_t)work->info.height / (size_t)height;
            const size_t texel = y * (size_t)work->info.width + x;
            double value = from != NULL ? 0.5 : 0.25;
            if (work->mask[texel] > 0.0f) {
                value = (double)plane[texel];
                /* a difference of an eighth is all red, or all blue */
                value = from != NULL ? 0.5 + 4.0 * (value - (double)from[texel]) : value;
            }
            pixels[row * width + column] = (uint8_t)lround(255.0 * fmin(1.0, fmax(0.0, value)));
        }
    }
}

static void write_thumbnails(FILE *out, const trade_work *work, const trade_subject *subject) {
    const int longest = work->info.width > work->info.height ? work->info.width : work->info.height;
    const int most = longest < THUMB ? longest : THUMB;
    const int width = (int)fmax(1.0, (double)work->info.width * most / longest);
    const int height = (int)fmax(1.0, (double)work->info.height * most / longest);
    uint8_t gray[256][3], difference[256][3], pixels[THUMB * THUMB];
    make_palettes(gray, difference);
    for (size_t i = 0; i < subject->run_count; ++i) {
        const trade_run *run = &subject->runs[i];
        if (!run->front) {
            continue;
        }
        fputs("<figure>", out);
        shrink(work, subject->truth, NULL, width, height, pixels);
        trade_png_write(out, width, height, pixels, gray, "truth");
        shrink(work, run->values, NULL, width, height, pixels);
        fputc(' ', out);
        trade_png_write(out, width, height, pixels, gray, "bake");
        shrink(work, run->values, subject->truth, width, height, pixels);
        fputc(' ', out);
        trade_png_write(out, width, height, pixels, difference, "difference");
        fprintf(out, "<figcaption><code>%s</code>, RMSE %.4f</figcaption></figure>\n", run->options,
                run->metrics.rmse);
    }
}

/* --- the page */

static void write_page(FILE *out, const trade_work *work) {
    fputs(head, out);
    fputs("<title>Speed against accuracy: ", out);
    write_escaped(out, work->settings->bake.input);
    fputs("</title>\n<h1>Speed against accuracy</h1>\n<p><code>", out);
    write_escaped(out, work->settings->bake.input);
    fprintf(out, "</code>, %d × %d, %zu valid texels, one sample each; %s. Truth: %s. vdbshade %s.</p>\n",
            work->info.width, work->info.height, work->valid,
            work->run.threads == 1 ? "one thread, processor time" : "several threads", work->truth_text,
            vsh_version());
    if (work->skipped > 0) {
        fprintf(out,
                "<p>%zu runs did not fit into the budget of %g s; <code>--budget</code> gives more.</p>\n",
                work->skipped, work->settings->budget);
    }
    for (size_t s = 0; s < work->subject_count; ++s) {
        const trade_subject *subject = &work->subjects[s];
        fprintf(out, "<h2>%s</h2>\n", subject->ao ? "Ambient occlusion" : "Shadow");
        trade_plot_write(out, work, subject);
        write_targets(out, work, subject);
        fputs("<h3>On the front: truth, bake, difference (red: too light by 1/8 or more, blue: too dark)"
              "</h3>\n",
              out);
        write_thumbnails(out, work, subject);
        fputs("<h3>All runs</h3>\n", out);
        write_table(out, work, subject);
    }
    fputs("<p>In penumbrae: texels whose truth lies in 0.02 … 0.98. Width error: how far the distances from "
          "10 % to 90 % are off, relative to them. Certified: values that a cone proved. Shaded rows are on "
          "the "
          "Pareto front: nothing measured is both faster and nearer to the truth.</p>\n</html>\n",
          out);
}

static void write_rows(FILE *out, const trade_work *work) {
    fputs(
        "subject,method,options,resolution,build_s,bake_s,s_per_million,bytes,texels,rmse,penumbra_rmse,bias,"
        "p95,p99,max,width_error,certified,front\n",
        out);
    for (size_t s = 0; s < work->subject_count; ++s) {
        const trade_subject *subject = &work->subjects[s];
        for (size_t i = 0; i < subject->run_count; ++i) {
            const trade_run *r = &subject->runs[i];
            const trade_metrics *m = &r->metrics;
            fprintf(out, "%s,%s,%s,%d,%.6g,%.6g,%.6g,%" PRIu64 ",%zu,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,",
                    subject->name, r->method, r->options, r->resolution, r->build_s, r->bake_s,
                    trade_rate(work, subject, r), r->bytes, work->valid, m->rmse, m->penumbra_rmse, m->bias,
                    m->p95, m->p99, m->max);
            fprintf(out, isnan(m->width_error) ? "," : "%.6f,", m->width_error);
            fprintf(out, isnan(r->certified) ? "," : "%.6f,", r->certified);
            fprintf(out, "%d\n", r->front);
        }
    }
}

/* Composes a text and writes it, whole or not at all. */
static int write_text(const trade_work *work, const char *path, void (*compose)(FILE *, const trade_work *)) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL) {
        return trade_out_of_memory(path);
    }
    compose(out, work);
    if (fclose(out) != 0) {
        free(text);
        return trade_out_of_memory(path);
    }
    cli_signals_writing(path);
    const int code = cli_temporary_write(path, text);
    cli_signals_writing(NULL);
    free(text);
    return code;
}

int trade_write_report(const trade_work *work) {
    return write_text(work, work->settings->report, write_page);
}

int trade_write_csv(const trade_work *work) {
    return work->settings->csv != NULL ? write_text(work, work->settings->csv, write_rows) : CLI_OK;
}
