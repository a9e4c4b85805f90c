/* Error against time, as a picture. */
#include "trade.h"

#include <math.h>
#include <string.h>

enum { WIDTH = 860, HEIGHT = 540, LEFT = 64, RIGHT = 164, TOP = 16, BOTTOM = 48 };

/* A picture brings its own looks, as it also stands alone. */
static const char style[] =
    "<style>.plot text{font:13px system-ui,sans-serif;fill:#222}.plot .grid{stroke:#e4e4e4;fill:none}"
    ".plot .minor{stroke:#f3f3f3;fill:none}.plot .sweep{stroke-width:1;stroke-opacity:.45;fill:none}"
    ".plot .front{stroke:#111;stroke-width:1.5;stroke-dasharray:5 3;fill:none}"
    ".plot .embree{stroke:#000;stroke-width:2;fill:none}</style>\n";

/* Colours that are told apart without red against green (Okabe and Ito, 2008). */
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

/* The part of a logarithmic axis that holds all values, in powers of ten. */
typedef struct axis {
    double low, high;
} axis;

static void grow(axis *a, double value) {
    const double power = log10(value);
    a->low = fmin(a->low, power);
    a->high = fmax(a->high, power);
}

static void settle(axis *a) {
    if (!(a->low <= a->high)) {
        *a = (axis){-1.0, 1.0};
    }
    a->low -= 0.08;
    a->high += 0.08;
    const double lacking = 0.5 * (1.0 - (a->high - a->low));
    if (lacking > 0.0) {
        a->low -= lacking;
        a->high += lacking;
    }
}

typedef struct plot {
    FILE *out;
    const trade_work *work;
    const trade_subject *subject;
    axis x, y;
} plot;

/* Errors that are 0 stand at the bottom. */
static double error_of(const trade_run *run) {
    return fmax(run->metrics.rmse, 1e-4);
}

static double at_x(const plot *p, double value) {
    return LEFT + (log10(value) - p->x.low) / (p->x.high - p->x.low) * (WIDTH - LEFT - RIGHT);
}

static double at_y(const plot *p, double value) {
    return TOP + (p->y.high - log10(value)) / (p->y.high - p->y.low) * (HEIGHT - TOP - BOTTOM);
}

static double x_of(const plot *p, const trade_run *run) {
    return at_x(p, run->rate);
}

/* Lines at 1, 2 and 5 times each power of ten; all are labelled where the axis is short enough for that. */
static void write_grid(const plot *p) {
    const bool all_x = p->x.high - p->x.low < 3.5, all_y = p->y.high - p->y.low < 3.5;
    for (int power = -7; power <= 6; ++power) {
        for (int step = 1; step <= 5; step += step == 1 ? 1 : 3) {
            const double value = step * pow(10.0, power), l = log10(value);
            const char *class = step == 1 ? "grid" : "minor";
            if (l >= p->x.low && l <= p->x.high) {
                const double x = at_x(p, value);
                fprintf(p->out, "<path class=\"%s\" d=\"M%.1f %dV%d\"/>", class, x, TOP, HEIGHT - BOTTOM);
                if (step == 1 || all_x) {
                    fprintf(p->out, "<text x=\"%.1f\" y=\"%d\" text-anchor=\"middle\">%g</text>\n", x,
                            HEIGHT - BOTTOM + 18, value);
                }
            }
            if (l >= p->y.low && l <= p->y.high) {
                const double y = at_y(p, value);
                fprintf(p->out, "<path class=\"%s\" d=\"M%d %.1fH%d\"/>", class, LEFT, y, WIDTH - RIGHT);
                if (step == 1 || all_y) {
                    fprintf(p->out, "<text x=\"%d\" y=\"%.1f\" text-anchor=\"end\">%g</text>\n", LEFT - 6,
                            y + 4.0, value);
                }
            }
        }
    }
    fprintf(p->out,
            "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">bake, microseconds a value</text>\n"
            "<text transform=\"translate(14 %d) rotate(-90)\" text-anchor=\"middle\">RMSE against the "
            "truth</text>\n",
            (LEFT + WIDTH - RIGHT) / 2, HEIGHT - 10, (TOP + HEIGHT - BOTTOM) / 2);
}

static bool on_front(const trade_run *run, const trade_run *like) {
    (void)like;
    return run->front;
}

static bool same_sweep(const trade_run *run, const trade_run *like) {
    return strcmp(run->method, like->method) == 0 && run->resolution == like->resolution;
}

/* The runs of a kind joined in the order of their time. */
static void write_line(const plot *p, bool (*belongs)(const trade_run *, const trade_run *),
                       const trade_run *like, const char *class, const char *color) {
    const trade_subject *s = p->subject;
    double last = -INFINITY;
    bool begun = false;
    for (;;) {
        const trade_run *next = NULL;
        double next_rate = INFINITY;
        for (size_t i = 0; i < s->run_count; ++i) {
            const double rate = s->runs[i].rate;
            if (belongs(&s->runs[i], like) && rate > last && rate < next_rate) {
                next = &s->runs[i];
                next_rate = rate;
            }
        }
        if (next == NULL) {
            break;
        }
        if (!begun) {
            fprintf(p->out, "<polyline class=\"%s\" stroke=\"%s\" points=\"", class, color);
        }
        fprintf(p->out, "%.1f,%.1f ", x_of(p, next), at_y(p, error_of(next)));
        begun = true;
        last = next_rate;
    }
    if (begun) {
        fputs("\"/>\n", p->out);
    }
}

/* One method at one voxel size, its numbers growing: a curve of its own. */
static void write_sweeps(const plot *p) {
    for (size_t i = 0; i < p->subject->run_count; ++i) {
        const trade_run *run = &p->subject->runs[i];
        bool first = true;
        for (size_t k = 0; k < i && first; ++k) {
            first = !same_sweep(&p->subject->runs[k], run);
        }
        if (first) {
            write_line(p, same_sweep, run, run->embree ? "embree" : "sweep", color_of(run->method));
        }
    }
}

/* Finer voxels are larger dots. */
static double radius_of(const plot *p, int32_t resolution) {
    size_t coarser = 0;
    for (size_t i = 0; i < p->work->field_count; ++i) {
        coarser += p->work->fields[i].resolution < resolution;
    }
    const double part = p->work->field_count > 1 ? (double)coarser / (double)(p->work->field_count - 1) : 0.5;
    return resolution == 0 ? 3.0 : 2.5 + 3.5 * part;
}

static void write_points(const plot *p) {
    for (size_t i = 0; i < p->subject->run_count; ++i) {
        const trade_run *run = &p->subject->runs[i];
        fprintf(p->out,
                "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%g\" fill=\"%s\"%s><title>%s%s: RMSE %.4f, %.3g "
                "µs</title></circle>\n",
                x_of(p, run), at_y(p, error_of(run)), radius_of(p, run->resolution), color_of(run->method),
                run->front ? " stroke=\"#000\" stroke-width=\"1.5\"" : "", run->embree ? "Embree, " : "",
                run->options, run->metrics.rmse, run->rate);
    }
}

static void write_sizes(const plot *p, int y) {
    for (size_t i = p->work->field_count; i-- > 0; y += 20) {
        const int32_t resolution = p->work->fields[i].resolution;
        fprintf(p->out,
                "<circle cx=\"%d\" cy=\"%d\" r=\"%g\" fill=\"#bbb\"/><text x=\"%d\" y=\"%d\">%d "
                "voxels</text>\n",
                WIDTH - RIGHT + 16, y, radius_of(p, resolution), WIDTH - RIGHT + 30, y + 4, resolution);
    }
}

static void write_legend(const plot *p) {
    int line = 0;
    for (size_t c = 0; c < COLOR_COUNT; ++c) {
        bool used = false;
        for (size_t i = 0; i < p->subject->run_count && !used; ++i) {
            used = strcmp(p->subject->runs[i].method, colors[c].method) == 0;
        }
        if (used) {
            const int y = TOP + 12 + 20 * line++;
            fprintf(p->out,
                    "<circle cx=\"%d\" cy=\"%d\" r=\"4\" fill=\"%s\"/><text x=\"%d\" y=\"%d\">%s</text>\n",
                    WIDTH - RIGHT + 16, y, colors[c].color, WIDTH - RIGHT + 30, y + 4,
                    strcmp(colors[c].method, "embree") == 0 ? "Embree’s rays" : colors[c].method);
        }
    }
    const int y = TOP + 12 + 20 * line;
    fprintf(p->out, "<path class=\"front\" d=\"M%d %dh18\"/><text x=\"%d\" y=\"%d\">Pareto front</text>\n",
            WIDTH - RIGHT + 6, y, WIDTH - RIGHT + 30, y + 4);
    write_sizes(p, y + 28);
}

void trade_plot_write(FILE *out, const trade_work *work, const trade_subject *subject) {
    plot p = {out, work, subject, {INFINITY, -INFINITY}, {INFINITY, -INFINITY}};
    for (size_t i = 0; i < subject->run_count; ++i) {
        grow(&p.x, subject->runs[i].rate);
        grow(&p.y, error_of(&subject->runs[i]));
    }
    settle(&p.x);
    settle(&p.y);
    fprintf(out,
            "<svg class=\"plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" role=\"img\" "
            "aria-label=\"error against time\">\n%s<rect width=\"%d\" height=\"%d\" fill=\"#fff\"/>\n",
            WIDTH, HEIGHT, style, WIDTH, HEIGHT);
    write_grid(&p);
    write_sweeps(&p);
    write_line(&p, on_front, NULL, "front", "#111");
    write_points(&p);
    write_legend(&p);
    fputs("</svg>\n", out);
}
