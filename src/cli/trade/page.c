/* The page: error against time as a plot and as tables, with nothing beside it; and the CSV. */
#include "cli/message.h"
#include "cli/temporary.h"
#include "trade.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

/* --- the plot: RMSE against time, both logarithmic */

enum { WIDTH = 860, HEIGHT = 540, LEFT = 64, RIGHT = 164, TOP = 16, BOTTOM = 48 };

/* The plot has its own style, because it also stands alone, cut out of the page. */
static const char plot_style[] =
    "<style>.plot text{font:13px system-ui,sans-serif;fill:#222}.plot .grid{stroke:#e4e4e4;fill:none}"
    ".plot .minor{stroke:#f3f3f3;fill:none}.plot .sweep{stroke-width:1;stroke-opacity:.45;fill:none}"
    ".plot .front{stroke:#111;stroke-width:1.5;stroke-dasharray:5 3;fill:none}"
    ".plot .embree{stroke:#000;stroke-width:2;fill:none}</style>\n";

/* Colours that differ without red against green (Okabe and Ito, 2008). */
static const struct {
    const char *method, *color;
} colors[] = {
    {"hard", "#999999"},     {"taps", "#999999"},  {"classic", "#cc79a7"}, {"improved", "#aa4499"},
    {"smooth", "#e69f00"},   {"cone", "#d55e00"},  {"cones", "#d55e00"},   {"rays", "#56b4e9"},
    {"adaptive", "#009e73"}, {"exact", "#0072b2"}, {"auto", "#f0e442"},    {"embree", "#000000"},
};
enum { COLOR_COUNT = sizeof colors / sizeof colors[0] };

static const char *color_of(const char *method) {
    for (size_t i = 0; i < COLOR_COUNT; ++i) {
        if (strcmp(colors[i].method, method) == 0) {
            return colors[i].color;
        }
    }
    return "#666666";
}

/* A logarithmic axis: powers of ten, and the pixels that they lie at. */
typedef struct axis {
    double low, high, from, to;
} axis;

typedef struct plot {
    FILE *out;
    const trade_work *work;
    const trade_subject *subject;
    axis axes[2]; /* x and y */
} plot;

static void include_value(axis *a, double value) {
    a->low = fmin(a->low, log10(value));
    a->high = fmax(a->high, log10(value));
}

/* Widens an axis by a margin, and to one power of ten at least. */
static void widen(axis *a) {
    if (!(a->low <= a->high)) {
        a->low = -1.0;
        a->high = 1.0;
    }
    const double margin = fmax(0.08, 0.5 * (1.0 - (a->high - a->low)));
    a->low -= margin;
    a->high += margin;
}

static double place(const axis *a, double value) {
    return a->from + (log10(value) - a->low) / (a->high - a->low) * (a->to - a->from);
}

/* An error of 0 stands at the bottom. */
static double error_of(const trade_run *run) {
    return fmax(run->metrics.rmse, 1e-4);
}

/* Draws lines at 1, 2 and 5 times each power of ten; a short axis has a label at each. */
static void write_grid(const plot *p, const axis *a) {
    static const int steps[] = {1, 2, 5};
    const bool across = a == &p->axes[0], all = a->high - a->low < 3.5;
    for (int i = 0; i < 3 * 14; ++i) {
        const int step = steps[i % 3];
        const double value = step * pow(10.0, i / 3 - 7), at = place(a, value);
        if (log10(value) < a->low || log10(value) > a->high) {
            continue;
        }
        fprintf(p->out, "<path class=\"%s\" d=\"M%.1f %.1f%c%d\"/>", step == 1 ? "grid" : "minor",
                across ? at : LEFT, across ? TOP : at, across ? 'V' : 'H',
                across ? HEIGHT - BOTTOM : WIDTH - RIGHT);
        if (step == 1 || all) {
            fprintf(p->out, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">%g</text>\n",
                    across ? at : LEFT - 6.0, across ? HEIGHT - BOTTOM + 18.0 : at + 4.0,
                    across ? "middle" : "end", value);
        }
    }
}

/* Whether a run is on the line through `like`, or (NULL) on the front. */
static bool is_on_line(const trade_run *run, const trade_run *like) {
    return like == NULL ? run->front
                        : strcmp(run->method, like->method) == 0 && run->resolution == like->resolution;
}

/* Joins the runs of a line in the order of their times. */
static void write_line(const plot *p, const trade_run *like, const char *class, const char *color) {
    double last = -INFINITY;
    fprintf(p->out, "<polyline class=\"%s\" stroke=\"%s\" points=\"", class, color);
    for (;;) {
        const trade_run *next = NULL;
        for (size_t i = 0; i < p->subject->run_count; ++i) {
            const trade_run *run = &p->subject->runs[i];
            if (is_on_line(run, like) && run->rate > last && (next == NULL || run->rate < next->rate)) {
                next = run;
            }
        }
        if (next == NULL) {
            break;
        }
        fprintf(p->out, "%.1f,%.1f ", place(&p->axes[0], next->rate), place(&p->axes[1], error_of(next)));
        last = next->rate;
    }
    fputs("\"/>\n", p->out);
}

/* A line for each method at each voxel size, and one for the front. */
static void write_lines(const plot *p) {
    for (size_t i = 0; i < p->subject->run_count; ++i) {
        const trade_run *run = &p->subject->runs[i];
        bool first = true;
        for (size_t k = 0; k < i && first; ++k) {
            first = !is_on_line(&p->subject->runs[k], run);
        }
        if (first) {
            write_line(p, run, run->embree ? "embree" : "sweep", color_of(run->method));
        }
    }
    write_line(p, NULL, "front", "#111");
}

/* Finer voxels have larger dots. */
static double radius_of(const plot *p, int32_t resolution) {
    size_t coarser = 0;
    for (size_t i = 0; i < p->work->field_count; ++i) {
        coarser += p->work->fields[i].resolution < resolution;
    }
    const double part = p->work->field_count > 1 ? (double)coarser / (double)(p->work->field_count - 1) : 0.5;
    return resolution == 0 ? 3.0 : 2.5 + 3.5 * part;
}

static void write_dots(const plot *p) {
    for (size_t i = 0; i < p->subject->run_count; ++i) {
        const trade_run *run = &p->subject->runs[i];
        fprintf(p->out,
                "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%g\" fill=\"%s\"%s><title>%s%s: RMSE %.4f, %.3g "
                "µs</title></circle>\n",
                place(&p->axes[0], run->rate), place(&p->axes[1], error_of(run)),
                radius_of(p, run->resolution), color_of(run->method),
                run->front ? " stroke=\"#000\" stroke-width=\"1.5\"" : "", run->embree ? "Embree, " : "",
                run->options, run->metrics.rmse, run->rate);
    }
}

static void write_legend_dot(const plot *p, int y, double radius, const char *color) {
    fprintf(p->out, "<circle cx=\"%d\" cy=\"%d\" r=\"%g\" fill=\"%s\"/><text x=\"%d\" y=\"%d\">",
            WIDTH - RIGHT + 16, y, radius, color, WIDTH - RIGHT + 30, y + 4);
}

static void write_legend(const plot *p) {
    int y = TOP + 12;
    for (size_t c = 0; c < COLOR_COUNT; ++c) {
        const char *method = colors[c].method;
        bool used = false;
        for (size_t i = 0; i < p->subject->run_count && !used; ++i) {
            used = strcmp(p->subject->runs[i].method, method) == 0;
        }
        if (used) {
            write_legend_dot(p, y, 4.0, colors[c].color);
            fprintf(p->out, "%s</text>\n", strcmp(method, "embree") == 0 ? "Embree’s rays" : method);
            y += 20;
        }
    }
    fprintf(p->out, "<path class=\"front\" d=\"M%d %dh18\"/><text x=\"%d\" y=\"%d\">Pareto front</text>\n",
            WIDTH - RIGHT + 6, y, WIDTH - RIGHT + 30, y + 4);
    y += 28;
    for (size_t i = p->work->field_count; i-- > 0; y += 20) {
        const int32_t resolution = p->work->fields[i].resolution;
        write_legend_dot(p, y, radius_of(p, resolution), "#bbb");
        fprintf(p->out, "%d voxels</text>\n", resolution);
    }
}

static void write_plot(FILE *out, const trade_work *work, const trade_subject *subject) {
    plot p = {out,
              work,
              subject,
              {{INFINITY, -INFINITY, LEFT, WIDTH - RIGHT}, {INFINITY, -INFINITY, HEIGHT - BOTTOM, TOP}}};
    for (size_t i = 0; i < subject->run_count; ++i) {
        include_value(&p.axes[0], subject->runs[i].rate);
        include_value(&p.axes[1], error_of(&subject->runs[i]));
    }
    widen(&p.axes[0]);
    widen(&p.axes[1]);
    fprintf(out,
            "<div class=\"wide\">\n<svg class=\"plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 "
            "%d %d\" role=\"img\" aria-label=\"error against time\">\n%s<rect width=\"%d\" height=\"%d\" "
            "fill=\"#fff\"/>\n",
            WIDTH, HEIGHT, plot_style, WIDTH, HEIGHT);
    write_grid(&p, &p.axes[0]);
    write_grid(&p, &p.axes[1]);
    fprintf(out,
            "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">bake, microseconds a value</text>\n"
            "<text transform=\"translate(14 %d) rotate(-90)\" text-anchor=\"middle\">RMSE against the "
            "truth</text>\n",
            (LEFT + WIDTH - RIGHT) / 2, HEIGHT - 10, (TOP + HEIGHT - BOTTOM) / 2);
    write_lines(&p);
    write_dots(&p);
    write_legend(&p);
    fputs("</svg>\n</div>\n", out);
}

/* --- the tables */

/* Writes the fastest run with an RMSE of at most `target`. */
static void write_fastest(FILE *out, const trade_subject *subject, double target, bool embree) {
    const trade_run *best = NULL;
    for (size_t i = 0; i < subject->run_count; ++i) {
        const trade_run *run = &subject->runs[i];
        if (run->embree == embree && run->metrics.rmse <= target &&
            (best == NULL || run->rate < best->rate)) {
            best = run;
        }
    }
    if (best != NULL) {
        fprintf(out, "<td class=\"t\"><code>%s</code></td><td>%.3g</td>", best->options, best->rate);
    } else {
        fputs("<td class=\"t\">none of these</td><td>–</td>", out);
    }
}

static void write_targets(FILE *out, const trade_subject *subject, bool embree) {
    static const double targets[] = {0.05, 0.02, 0.01, 0.005};
    fprintf(out,
            "<h3>The fastest options for an error</h3>\n<div class=\"wide\"><table><tr><th>RMSE of at "
            "most</th><th class=\"t\">options</th><th>µs a value</th>%s</tr>\n",
            embree ? "<th class=\"t\">Embree’s rays</th><th>µs a value</th>" : "");
    for (size_t i = 0; i < sizeof targets / sizeof targets[0]; ++i) {
        fprintf(out, "<tr><td>%g</td>", targets[i]);
        write_fastest(out, subject, targets[i], false);
        if (embree) {
            write_fastest(out, subject, targets[i], true);
        }
        fputs("</tr>\n", out);
    }
    fputs("</table></div>\n", out);
}

static void write_runs(FILE *out, const trade_subject *subject) {
    fputs("<h3>All runs</h3>\n<div class=\"wide all\"><table><thead><tr><th class=\"t\">options</th>"
          "<th>build s</th><th>bake s</th><th>µs a value</th><th>MB</th><th>RMSE</th><th>in penumbrae</th>"
          "<th>bias</th><th>p95</th><th>p99</th><th>max</th><th>width error</th>"
          "<th>RMSE, own texels</th></tr></thead>\n",
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
        fprintf(out, "<td>%.4f</td></tr>\n", run->valid_rmse);
    }
    fputs("</table></div>\n", out);
}

/* --- the page */

static const char head[] =
    "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n"
    "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n<style>\n"
    "body{font:15px/1.5 system-ui,sans-serif;margin:1.5em auto;max-width:1100px;padding:0 1em;color:#111;"
    "background:#fff;overflow-wrap:break-word}\n"
    "h1,h2,h3{line-height:1.25}h2{margin-top:2em}svg{width:100%;max-width:860px;min-width:640px;height:auto}"
    "\n.wide{overflow-x:auto;margin:1em 0}table{border-collapse:collapse;font-size:13px}"
    "th,td{padding:.3em .6em;text-align:right;border-bottom:1px solid #e4e4e4}td{white-space:nowrap}"
    "th{vertical-align:bottom}td.t,th.t{text-align:left}tr.f{background:#eef6f1}"
    ".all{max-height:40em;overflow:auto}.all thead th{position:sticky;top:0;background:#fff}"
    "code{font:12px ui-monospace,monospace}"
    "dl{display:grid;grid-template-columns:max-content 1fr;gap:.2em 1em;font-size:14px}dt{font-weight:600}"
    "dd{margin:0}\n@media(max-width:600px){dl{display:block}dd{margin:0 0 .6em}}\n</style>\n";

static void write_receivers(FILE *out, const trade_work *work) {
    fputs("<dt>Receivers</dt><dd>", out);
    for (size_t r = 0; r < work->receiver_count; ++r) {
        const trade_receiver *receiver = &work->receivers[r];
        fputs(r > 0 ? "; " : "", out);
        cli_escape(out, work->scene->receivers[r].path);
        fprintf(out, ", %d × %d", receiver->info.width, receiver->info.height);
    }
    if (work->settings->receiver >= 0) {
        fprintf(out, " (number %d of the scene, by <code>--receiver</code>)", work->settings->receiver);
    }
    fprintf(out,
            "</dd>\n<dt>Texels</dt><dd>%zu of %zu under charts are measured, with one sample each: those "
            "that are valid, neither inside a solid nor behind a wall, at all voxel sizes. Left out:",
            work->common_count, work->covered);
    for (size_t f = work->field_count; f-- > 0;) {
        fprintf(out, " %zu invalid at %d voxels%s", work->covered - work->fields[f].valid,
                work->fields[f].resolution, f > 0 ? "," : "");
    }
    fprintf(out, "; %zu at all sizes.</dd>\n", work->covered - work->points);
}

static void write_conditions(FILE *out, const trade_work *work) {
    fputs("<dl><dt>Input</dt><dd><code>", out);
    cli_escape(out, work->settings->bake.input);
    fputs("</code></dd>\n", out);
    write_receivers(out, work);
    fprintf(
        out,
        "<dt>Truth</dt><dd>%d rays a texel, from just above it, against the casters themselves%s%s; it took "
        "%.1f s.</dd>\n",
        work->settings->truth_rays, work->triangles != NULL ? "; triangles by Embree" : "",
        work->solids != NULL ? "; procedural shapes by sphere tracing in double precision" : "",
        work->truth_s);
    fprintf(
        out,
        "<dt>Time</dt><dd>%s; the median of three bakes if they are short. A bake finds the valid texels, "
        "places the origins of rays, and shades. Building makes voxels and field%s. A value is one "
        "light at one texel, or the AO of one texel.</dd>\n",
        work->run.threads == 1 ? "Processor time of one thread" : "Wall time of all threads",
        work->meshes ? ", and the tree of triangles for methods that trace them. Embree’s time is that "
                       "of making and tracing the rays, from texels known to be valid"
                     : "");
    if (work->skipped > 0) {
        fprintf(out,
                "<dt>Budget</dt><dd>%zu runs did not fit into the budget of %g s; <code>--budget</code> "
                "gives more.</dd>\n",
                work->skipped, work->settings->budget);
    }
    fprintf(out, "<dt>Made by</dt><dd>vdbshade %s</dd></dl>\n", vsh_version());
}

static void compose_page(FILE *out, const trade_work *work) {
    fputs(head, out);
    fputs("<title>Speed against accuracy: ", out);
    cli_escape(out, work->settings->bake.input);
    fputs("</title>\n<h1>Speed against accuracy</h1>\n", out);
    write_conditions(out, work);
    for (size_t s = 0; s < work->subject_count; ++s) {
        const trade_subject *subject = &work->subjects[s];
        fprintf(out, "<h2>%s</h2>\n", subject->ao ? "Ambient occlusion" : "Shadow");
        write_plot(out, work, subject);
        write_targets(out, subject, work->meshes);
        write_runs(out, subject);
    }
    fputs("<p>In penumbrae: texels with a truth of 0.02 … 0.98. Width error: how far the distances from 10 % "
          "to 90 % are off, relative to them. Own texels: those that "
          "are valid at the run’s own voxel size. Shaded rows are on the Pareto front: no other run is both "
          "faster and nearer to the truth.</p>\n</html>\n",
          out);
}

int trade_write_page(const trade_work *work) {
    cli_temporary page;
    CLI_TRY(cli_temporary_begin(&page, work->settings->page));
    compose_page(page.file, work);
    return cli_temporary_commit(&page);
}

/* --- the CSV, with every digit; bench/README.md explains the columns */

static void compose_csv(FILE *out, const trade_work *work) {
    fputs("subject,method,options,resolution,build_s,bake_s,us_per_value,bytes,covered,invalid,left_out,"
          "texels,rmse,penumbra_rmse,bias,p95,p99,max,width_error,front,valid_rmse\n",
          out);
    for (size_t s = 0; s < work->subject_count; ++s) {
        const trade_subject *subject = &work->subjects[s];
        for (size_t i = 0; i < subject->run_count; ++i) {
            const trade_run *r = &subject->runs[i];
            const vsh_accuracy *m = &r->metrics;
            fprintf(out, "%s,%s,%s,%d,%.6g,%.6g,%.6g,%" PRIu64 ",%zu,%zu,%zu,%zu,",
                    subject->ao ? "ao" : "shadow", r->method, r->options, r->resolution, r->build_s,
                    r->bake_s, r->rate, r->bytes, work->covered, work->covered - r->valid,
                    r->valid - work->common_count, work->common_count);
            fprintf(out, "%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,", m->rmse, m->penumbra_rmse, m->bias, m->p95, m->p99,
                    m->max);
            fprintf(out, isnan(m->width_error) ? "," : "%.6f,", m->width_error);
            fprintf(out, "%d,%.6f\n", r->front, r->valid_rmse);
        }
    }
}

int trade_write_csv(const trade_work *work) {
    if (work->settings->csv == NULL) {
        return CLI_OK;
    }
    cli_temporary csv;
    CLI_TRY(cli_temporary_begin(&csv, work->settings->csv));
    compose_csv(csv.file, work);
    return cli_temporary_commit(&csv);
}
