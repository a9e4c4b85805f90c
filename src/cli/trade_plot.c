#include "trade_plot.h"

#include <math.h>
#include <string.h>

enum { WIDTH = 860, HEIGHT = 520, LEFT = 64, RIGHT = 150, TOP = 16, BOTTOM = 48 };

/* Colours that are told apart without red against green (Okabe and Ito, 2008). */
static const struct {
    const char *method, *color;
} colors[] = {
    {"hard", "#999999"},     {"taps", "#999999"},  {"classic", "#cc79a7"}, {"improved", "#aa4499"},
    {"smooth", "#e69f00"},   {"cone", "#d55e00"},  {"cones", "#d55e00"},   {"rays", "#56b4e9"},
    {"adaptive", "#009e73"}, {"exact", "#0072b2"}, {"embree", "#000000"},
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

double trade_rate(const trade_work *work, const trade_subject *subject, const trade_run *run) {
    return run->bake_s / (double)(subject->planes * work->valid) * 1e6;
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
    return at_x(p, trade_rate(p->work, p->subject, run));
}

static void write_grid(const plot *p) {
    for (int power = -7; power <= 6; ++power) {
        for (int step = 1; step <= 5; step += step == 1 ? 1 : 3) {
            const double value = step * pow(10.0, power), l = log10(value);
            if (l >= p->x.low && l <= p->x.high) {
                fprintf(p->out,
                        "<path class=\"grid\" d=\"M%.1f %dV%d\"/><text x=\"%.1f\" y=\"%d\" "
                        "text-anchor=\"middle\">%g</text>\n",
                        at_x(p, value), TOP, HEIGHT - BOTTOM, at_x(p, value), HEIGHT - BOTTOM + 16, value);
            }
            if (l >= p->y.low && l <= p->y.high) {
                fprintf(p->out,
                        "<path class=\"grid\" d=\"M%d %.1fH%d\"/><text x=\"%d\" y=\"%.1f\" "
                        "text-anchor=\"end\">%g</text>\n",
                        LEFT, at_y(p, value), WIDTH - RIGHT, LEFT - 6, at_y(p, value) + 4.0, value);
            }
        }
    }
    fprintf(p->out,
            "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">bake, seconds for a million values</text>\n"
            "<text transform=\"translate(14 %d) rotate(-90)\" text-anchor=\"middle\">RMSE against the "
            "truth</text>\n",
            (LEFT + WIDTH - RIGHT) / 2, HEIGHT - 10, (TOP + HEIGHT - BOTTOM) / 2);
}

/* The runs of a kind joined in the order of their time. */
static void write_line(const plot *p, bool front, const char *class) {
    const trade_subject *s = p->subject;
    double last = -INFINITY;
    bool begun = false;
    for (;;) {
        const trade_run *next = NULL;
        for (size_t i = 0; i < s->run_count; ++i) {
            const trade_run *run = &s->runs[i];
            if ((front ? run->front : run->embree) && run->bake_s > last &&
                (next == NULL || run->bake_s < next->bake_s)) {
                next = run;
            }
        }
        if (next == NULL) {
            break;
        }
        if (!begun) {
            fprintf(p->out, "<polyline class=\"%s\" points=\"", class);
        }
        fprintf(p->out, "%.1f,%.1f ", x_of(p, next), at_y(p, error_of(next)));
        begun = true;
        last = next->bake_s;
    }
    if (begun) {
        fputs("\"/>\n", p->out);
    }
}

static void write_points(const plot *p) {
    for (size_t i = 0; i < p->subject->run_count; ++i) {
        const trade_run *run = &p->subject->runs[i];
        fprintf(p->out,
                "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%g\" fill=\"%s\"%s><title>%s %s: RMSE %.4f, %.3g "
                "s</title></circle>\n",
                x_of(p, run), at_y(p, error_of(run)), run->front ? 5.5 : 3.5, color_of(run->method),
                run->front ? " stroke=\"#000\" stroke-width=\"1.5\"" : "", run->embree ? "Embree," : "",
                run->options, run->metrics.rmse, run->bake_s);
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
                    WIDTH - RIGHT + 16, y, colors[c].color, WIDTH - RIGHT + 26, y + 4,
                    strcmp(colors[c].method, "embree") == 0 ? "Embree’s rays" : colors[c].method);
        }
    }
    const int y = TOP + 12 + 20 * line;
    fprintf(p->out, "<path class=\"front\" d=\"M%d %dh18\"/><text x=\"%d\" y=\"%d\">Pareto front</text>\n",
            WIDTH - RIGHT + 4, y, WIDTH - RIGHT + 26, y + 4);
}

void trade_plot_write(FILE *out, const trade_work *work, const trade_subject *subject) {
    plot p = {out, work, subject, {INFINITY, -INFINITY}, {INFINITY, -INFINITY}};
    for (size_t i = 0; i < subject->run_count; ++i) {
        grow(&p.x, trade_rate(work, subject, &subject->runs[i]));
        grow(&p.y, error_of(&subject->runs[i]));
    }
    settle(&p.x);
    settle(&p.y);
    fprintf(out, "<svg viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"error against time\">\n", WIDTH,
            HEIGHT);
    write_grid(&p);
    write_line(&p, false, "embree");
    write_line(&p, true, "front");
    write_points(&p);
    write_legend(&p);
    fputs("</svg>\n", out);
}
