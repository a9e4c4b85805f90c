/* The report: one page that needs nothing beside it, and the same numbers as CSV. */
#include "cli/document.h"
#include "cli/message.h"
#include "trade.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double targets[] = {0.05, 0.02, 0.01, 0.005};

static const char head[] =
    "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n"
    "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n<style>\n"
    "body{font:15px/1.5 system-ui,sans-serif;margin:1.5em auto;max-width:1100px;padding:0 1em;color:#111;"
    "background:#fff;overflow-wrap:break-word}\n"
    "h1,h2,h3{line-height:1.25}h2{margin-top:2em}svg{width:100%;max-width:860px;min-width:640px;height:auto}"
    "\n"
    ".wide{overflow-x:auto;margin:1em 0}table{border-collapse:collapse;font-size:13px}"
    "th,td{padding:.3em .6em;text-align:right;border-bottom:1px solid #e4e4e4;white-space:nowrap}"
    "th{vertical-align:bottom}.narrow th{white-space:normal}"
    ".targets td.t{white-space:normal;min-width:15em}td.t,th.t{text-align:left}tr.f{background:#eef6f1}"
    ".all{max-height:40em;overflow:auto}.all thead th{position:sticky;top:0;background:#fff}"
    "code{font:12px ui-monospace,monospace}code span{white-space:nowrap}"
    "img{image-rendering:pixelated;outline:1px solid "
    "#e4e4e4;vertical-align:top;width:32%;max-width:192px;height:auto}"
    ".shots{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,330px),1fr));gap:1em}"
    "figure{margin:0;font-size:12px;line-height:1.4}figure div{margin-bottom:3px}figcaption{margin-top:.3em}"
    "dl{display:grid;grid-template-columns:max-content 1fr;gap:.2em 1em;font-size:14px}dt{font-weight:600}"
    "dd{margin:0}\n"
    "@media(max-width:600px){dl{display:block}dd{margin:0 0 .6em}}\n</style>\n";

void trade_options_write(FILE *out, const char *options) {
    fputs("<code><span>", out);
    for (const char *at = options; *at != '\0'; ++at) {
        if (at[0] == ' ' && at[1] == '-') {
            fputs("</span> <span>", out);
        } else {
            fputc(*at, out);
        }
    }
    fputs("</span></code>", out);
}

/* --- which options reach an error in the least time */

/* The fastest of the runs whose RMSE is at most `target`; NULL where there is none. */
static const trade_run *fastest(const trade_subject *subject, double target, bool building, bool embree) {
    const trade_run *best = NULL;
    double best_time = INFINITY;
    for (size_t i = 0; i < subject->run_count; ++i) {
        const trade_run *run = &subject->runs[i];
        if (run->embree != embree || !(run->metrics.rmse <= target)) {
            continue;
        }
        const double time = building ? run->bake_s + run->build_s : run->rate;
        best = time < best_time ? run : best;
        best_time = fmin(time, best_time);
    }
    return best;
}

/* Two cells: a run, NULL for none, and its time. */
static void write_fastest(FILE *out, const trade_run *run, double time) {
    fputs("<td class=\"t\">", out);
    if (run == NULL) {
        fputs("none of these</td><td>–</td>", out);
        return;
    }
    trade_options_write(out, run->options);
    fprintf(out, "</td><td>%.3g</td>", time);
}

static void write_targets(FILE *out, const trade_subject *subject, bool embree_measured) {
    fprintf(out,
            "<div class=\"wide\"><table class=\"narrow targets\"><tr><th>RMSE of at most</th><th "
            "class=\"t\">least bake "
            "time with</th><th>µs a value</th>%s<th class=\"t\">least time, building included, "
            "with</th><th>s</th></tr>\n",
            embree_measured ? "<th>Embree’s rays, µs a value</th>" : "");
    for (size_t i = 0; i < sizeof targets / sizeof targets[0]; ++i) {
        const trade_run *bake = fastest(subject, targets[i], false, false);
        const trade_run *all = fastest(subject, targets[i], true, false);
        const trade_run *embree = fastest(subject, targets[i], false, true);
        fprintf(out, "<tr><td>%g</td>", targets[i]);
        write_fastest(out, bake, bake != NULL ? bake->rate : NAN);
        if (embree != NULL) {
            fprintf(out, "<td>%.3g (%s)</td>", embree->rate, embree->options);
        } else if (embree_measured) {
            fputs("<td>–</td>", out);
        }
        write_fastest(out, all, all != NULL ? all->bake_s + all->build_s : NAN);
        fputs("</tr>\n", out);
    }
    fputs("</table></div>\n", out);
}

/* --- the table */

static void write_table(FILE *out, const trade_subject *subject) {
    fputs("<div class=\"wide all\"><table class=\"narrow\"><thead><tr><th class=\"t\">options</th><th>build "
          "s</th><th>bake s</th><th>µs a value</th><th>MB</th><th>RMSE</th><th>in "
          "penumbrae</th><th>bias</th><th>p95</th><th>p99</th><th>max</th><th>width "
          "error</th><th>certified</th><th>RMSE, all its texels</th></tr></thead>\n",
          out);
    for (size_t i = 0; i < subject->run_count; ++i) {
        const trade_run *run = &subject->runs[i];
        const vsh_accuracy *m = &run->metrics;
        fprintf(out,
                "<tr%s><td class=\"t\">%s<code>%s</code></td><td>%.2f</td><td>%.3f</td><td>%.3g</td>"
                "<td>%.1f</td>",
                run->front ? " class=\"f\"" : "", run->embree ? "Embree, " : "", run->options, run->build_s,
                run->bake_s, run->rate, (double)run->bytes / 1e6);
        fprintf(out, "<td>%.4f</td><td>%.4f</td><td>%+.4f</td><td>%.3f</td><td>%.3f</td><td>%.3f</td>",
                m->rmse, m->penumbra_rmse, m->bias, m->p95, m->p99, m->max);
        fprintf(out, isnan(m->width_error) ? "<td>–</td>" : "<td>%.1f %%</td>", 100.0 * m->width_error);
        fprintf(out, isnan(run->certified) ? "<td>–</td>" : "<td>%.1f %%</td>", 100.0 * run->certified);
        fprintf(out, "<td>%.4f</td></tr>\n", run->valid_rmse);
    }
    fputs("</table></div>\n", out);
}

/* --- the page */

/* What is measured, and what is not. */
static void write_texels(FILE *out, const trade_work *work) {
    fputs("<dl><dt>Input</dt><dd><code>", out);
    cli_document_escape(out, work->settings->bake.input);
    fputs("</code></dd>\n<dt>Receivers</dt><dd>", out);
    for (size_t r = 0; r < work->receiver_count; ++r) {
        const trade_receiver *receiver = &work->receivers[r];
        fputs(r > 0 ? "; " : "", out);
        cli_document_escape(out, receiver->path);
        fprintf(out, ", %d × %d", receiver->info.width, receiver->info.height);
    }
    if (work->settings->receiver >= 0) {
        fprintf(out, " (number %d of the scene’s alone, as asked)", work->settings->receiver);
    }
    fprintf(out,
            "</dd>\n<dt>Texels</dt><dd>%zu measured, one sample each, of %zu that charts cover. Left out: "
            "what a bake itself marks as invalid (inside a solid or behind a wall) at one of the "
            "voxel sizes at least, so that all runs have the same texels:",
            work->common_count, work->covered);
    for (size_t f = work->field_count; f-- > 0;) {
        const trade_field *field = &work->fields[f];
        fprintf(out, " %zu invalid at %d voxels%s", work->covered - field->valid, field->resolution,
                f > 0 ? "," : "");
    }
    fprintf(
        out,
        "; %zu at all sizes. The last column of the table has the error over all texels that are valid at "
        "a run’s own voxel size.</dd>\n<dt>Truth</dt><dd>%s; it took %.1f s.</dd>\n",
        work->covered - work->points, work->truth_text, work->truth_s);
    fprintf(out,
            "<dt>Time</dt><dd>%s; median of three runs where they are short. A bake’s time is that of the "
            "whole "
            "bake stage: which texels are valid, where rays begin, cones and rays. Building is voxels and "
            "field%s. A value is one light’s at one texel, or one texel’s AO.</dd>\n",
            work->run.threads == 1 ? "one thread, processor time" : "all threads asked for, wall time",
            work->meshes
                ? ", and the tree of triangles where rays meet those. Embree’s time is that of making "
                  "and tracing the rays, from texels known to be valid"
                : "");
    if (work->skipped > 0) {
        fprintf(
            out,
            "<dt>Budget</dt><dd>%zu runs did not fit into the budget of %g s; <code>--budget</code> gives "
            "more.</dd>\n",
            work->skipped, work->settings->budget);
    }
    fprintf(out, "<dt>Made by</dt><dd>vdbshade %s</dd></dl>\n", vsh_version());
}

static void write_page(FILE *out, const void *user) {
    const trade_work *work = user;
    fputs(head, out);
    fputs("<title>Speed against accuracy: ", out);
    cli_document_escape(out, work->settings->bake.input);
    fputs("</title>\n<h1>Speed against accuracy</h1>\n", out);
    write_texels(out, work);
    for (size_t s = 0; s < work->subject_count; ++s) {
        const trade_subject *subject = &work->subjects[s];
        fprintf(out, "<h2>%s</h2>\n<div class=\"wide\">", subject->ao ? "Ambient occlusion" : "Shadow");
        trade_plot_write(out, work, subject);
        fputs("</div>\n<h3>Which options reach an error in the least time</h3>\n", out);
        write_targets(out, subject, work->meshes);
        fputs("<h3>On the front: truth, bake, difference</h3>\n<p>Red is too light by 1/8 or more, blue too "
              "dark; grey-blue is not measured.",
              out);
        trade_thumbnails_write(out, work, subject);
        fputs("<h3>All runs</h3>\n", out);
        write_table(out, subject);
    }
    fputs("<p>In penumbrae: texels whose truth lies in 0.02 … 0.98. Width error: how far the distances from "
          "10 % to 90 % are off, relative to them. Certified: values that a cone proved. Shaded rows are on "
          "the Pareto front: nothing measured is both faster and nearer to the truth.</p>\n</html>\n",
          out);
}

/* --- the table as CSV: what the page shows, with every digit */

/* covered: texels under charts; invalid: of them, those that a bake of this voxel size marks so; left_out:
 * valid ones that are invalid at another of the voxel sizes; texels: the rest, measured, the same in all
 * rows. */
static const char row_names[] = "subject,method,options,resolution,build_s,bake_s,us_per_value,bytes,covered,"
                                "invalid,left_out,texels,rmse,"
                                "penumbra_rmse,bias,p95,p99,max,width_error,certified,front,valid_rmse\n";

static void write_rows(FILE *out, const void *user) {
    const trade_work *work = user;
    fputs(row_names, out);
    for (size_t s = 0; s < work->subject_count; ++s) {
        const trade_subject *subject = &work->subjects[s];
        for (size_t i = 0; i < subject->run_count; ++i) {
            const trade_run *r = &subject->runs[i];
            const vsh_accuracy *m = &r->metrics;
            fprintf(out, "%s,%s,%s,%d,%.6g,%.6g,%.6g,%" PRIu64 ",%zu,%zu,%zu,%zu,", subject->name, r->method,
                    r->options, r->resolution, r->build_s, r->bake_s, r->rate, r->bytes, work->covered,
                    work->covered - r->valid, r->valid - work->common_count, work->common_count);
            fprintf(out, "%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,", m->rmse, m->penumbra_rmse, m->bias, m->p95, m->p99,
                    m->max);
            fprintf(out, isnan(m->width_error) ? "," : "%.6f,", m->width_error);
            fprintf(out, isnan(r->certified) ? "," : "%.6f,", r->certified);
            fprintf(out, "%d,%.6f\n", r->front, r->valid_rmse);
        }
    }
}

/* Of the shadow, or of AO where there are no lights. */
static void write_picture(FILE *out, const void *user) {
    const trade_work *work = user;
    trade_plot_write(out, work, &work->subjects[0]);
}

int trade_write_report(const trade_work *work) {
    return cli_document_write(work->settings->report, write_page, work);
}

int trade_write_csv(const trade_work *work) {
    return work->settings->csv != NULL ? cli_document_write(work->settings->csv, write_rows, work) : CLI_OK;
}

int trade_write_plot(const trade_work *work) {
    return work->settings->plot != NULL ? cli_document_write(work->settings->plot, write_picture, work)
                                        : CLI_OK;
}
