/* Judges a bake as a viewer sees it: compares bilinear lookups at random points of the surface with rays.
 *
 *   vsh_judge seen MODEL BAKE.exr [--sun X,Y,Z] [--sun-angle DEGREES] [--ao DISTANCE]
 *                  [--solids FILE.obj|-] [--receive MESH] [--uv-set N] [--list]
 *
 * --sun needs the channel `shadow.sun` in BAKE.exr, --ao needs `ao`. Lookups blend all pixels as a graphics
 * card does, padding and borders too. They ignore `A`. The output is lines of "NAME VALUE". Shares are in
 * percent. "wide" means the points on charts that are at least four texels wide. --list prints each point
 * that is off by more than a quarter.
 *
 * Points that see the backs of solids, or lie on a face turned the other way, are left out. A baker may
 * smooth shadow terminators. So shadows leave out points of bent faces where the horizon of the face or of
 * the smooth normal cuts the sun's disc, or where they disagree. */
#include "directions.h"
#include "embree_scene.h"
#include "judge.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/vdbshade.h>

enum { POINTS = 200000, RAYS = 128, SURE_RAYS = 4096, SHADOW = 0, AO = 1, CHANNELS = 2 };
static const double LIFT = 1e-5;  /* of the model's size */
static const double WRONG = 0.25; /* visible at a glance */
static const double WIDE = 4.0;   /* texels */
static const double PI = 3.14159265358979323846;

typedef struct answer {
    bool judged;
    float seen, truth,
        product; /* value in the image, the better answer of the rays, product of both sets' differences */
} answer;

typedef struct point {
    size_t triangle;
    double at[3], u, v;
    answer channel[CHANNELS];
} point;

typedef struct task {
    judge_scene scene;
    vsh_image image;
    const float *planes[CHANNELS]; /* NULL: not asked for */
    truth_frame sun;
    double half_angle, distance;
    double *area;  /* [triangles]: of all up to this one */
    double *width; /* [triangles]: of the chart, texels */
    point *points;
} task;

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Random number in 0 … 1 from counters: the finaliser of SplitMix64. */
static double random_number(uint64_t index, uint64_t use) {
    uint64_t z = (64 * index + use + 1) * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

typedef struct bake {
    vsh_image_file *file;
    vsh_image image;
    const char *path;
} bake;

static bake read_bake(const char *path) {
    vsh_error error;
    bake b = {.path = path};
    if (vsh_image_read(path, NULL, &b.file, &error) != VSH_OK) {
        judge_give_up(path, error.message);
    }
    b.image = vsh_image_view(b.file);
    return b;
}

static const float *plane_of(const bake *b, const char *name) {
    for (int32_t i = 0; i < b->image.channel_count; ++i) {
        if (strcmp(b->image.names[i], name) == 0) {
            return b->image.planes[i];
        }
    }
    fprintf(stderr, "judge: %s: no channel %s\n", b->path, name);
    exit(2);
}

/* --- charts */

typedef struct corner {
    double key[5]; /* u, v and the position: equal for corners that meet in the layout */
    size_t index;
} corner;

typedef struct edge {
    size_t from, to, triangle;
    double length; /* texels */
} edge;

static int compare_corners(const void *a, const void *b) {
    const corner *p = a, *q = b;
    for (int k = 0; k < 5; ++k) {
        if (p->key[k] != q->key[k]) {
            return p->key[k] < q->key[k] ? -1 : 1;
        }
    }
    return 0;
}

static int compare_edges(const void *a, const void *b) {
    const edge *p = a, *q = b;
    if (p->from != q->from) {
        return p->from < q->from ? -1 : 1;
    }
    return p->to != q->to ? (p->to < q->to ? -1 : 1) : 0;
}

static size_t root_of(size_t *parent, size_t i) {
    while (parent[i] != i) {
        i = parent[i] = parent[parent[i]];
    }
    return i;
}

/* Triangles that share an edge make a chart. Its width is that of the rectangle with its area and perimeter.
 */
static void measure_charts(task *t) {
    const size_t count = t->scene.count;
    corner *corners = judge_take(3 * count * sizeof *corners);
    edge *edges = judge_take(3 * count * sizeof *edges);
    size_t *vertex = judge_take(3 * count * sizeof *vertex), *parent = judge_take(count * sizeof *parent),
           used = 0;
    double *area = judge_take(count * sizeof *area), *perimeter = judge_take(count * sizeof *perimeter);
    for (size_t i = 0; i < 3 * count; ++i) {
        const judge_triangle *of = &t->scene.triangles[i / 3];
        if (isfinite(of->uv[0][0])) {
            memcpy(corners[used].key, of->uv[i % 3], sizeof of->uv[0]);
            memcpy(corners[used].key + 2, of->p[i % 3], sizeof of->p[0]);
            corners[used++].index = i;
        }
    }
    qsort(corners, used, sizeof *corners, compare_corners);
    for (size_t i = 0, id = 0; i < used; ++i) {
        id += i > 0 && compare_corners(&corners[i - 1], &corners[i]) != 0;
        vertex[corners[i].index] = id;
    }
    used = 0;
    for (size_t i = 0; i < count; ++i) {
        const judge_triangle *of = &t->scene.triangles[i];
        double side[3][2];
        parent[i] = i;
        for (int c = 0; c < 3 && isfinite(of->uv[0][0]); ++c) {
            const size_t a = vertex[3 * i + (size_t)c], b = vertex[3 * i + (size_t)(c + 1) % 3];
            side[c][0] = (of->uv[(c + 1) % 3][0] - of->uv[c][0]) * t->image.width;
            side[c][1] = (of->uv[(c + 1) % 3][1] - of->uv[c][1]) * t->image.height;
            edges[used++] = (edge){a < b ? a : b, a < b ? b : a, i, hypot(side[c][0], side[c][1])};
            area[i] = c == 1 ? 0.5 * fabs(side[0][0] * side[1][1] - side[0][1] * side[1][0]) : area[i];
        }
    }
    qsort(edges, used, sizeof *edges, compare_edges);
    for (size_t i = 1; i < used; ++i) {
        if (compare_edges(&edges[i - 1], &edges[i]) == 0) {
            parent[root_of(parent, edges[i].triangle)] = root_of(parent, edges[i - 1].triangle);
        }
    }
    for (size_t i = 0; i < used; ++i) {
        const bool inner = (i > 0 && compare_edges(&edges[i - 1], &edges[i]) == 0) ||
                           (i + 1 < used && compare_edges(&edges[i], &edges[i + 1]) == 0);
        perimeter[root_of(parent, edges[i].triangle)] += inner ? 0.0 : edges[i].length;
    }
    for (size_t i = 0; i < count; ++i) {
        const size_t root = root_of(parent, i);
        area[root] += root != i ? area[i] : 0.0;
    }
    for (size_t i = 0; i < count; ++i) {
        const size_t root = root_of(parent, i);
        const double quarter = 0.25 * perimeter[root];
        t->width[i] = quarter - sqrt(fmax(0.0, quarter * quarter - area[root]));
    }
    free(perimeter);
    free(area);
    free(parent);
    free(vertex);
    free(edges);
    free(corners);
}

/* --- points */

/* Places point i within its share of the surface's area. */
static void place_point(const task *t, size_t i, point *p, double normal[3]) {
    const double target = ((double)i + random_number(i, 0)) / POINTS * t->area[t->scene.count - 1];
    size_t low = 0, high = t->scene.count - 1;
    while (low < high) {
        const size_t middle = (low + high) / 2;
        if (t->area[middle] > target) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    const judge_triangle *of = &t->scene.triangles[low];
    const double root = sqrt(random_number(i, 1)), along = random_number(i, 2);
    const double weight[3] = {1.0 - root, root * (1.0 - along), root * along};
    p->triangle = low;
    p->u = p->v = 0.0;
    for (int c = 0; c < 3; ++c) {
        p->u += weight[c] * of->uv[c][0];
        p->v += weight[c] * of->uv[c][1];
        for (int k = 0; k < 3; ++k) {
            p->at[k] += weight[c] * of->p[c][k];
            normal[k] += weight[c] * of->n[c][k];
        }
    }
    const double length = sqrt(dot(normal, normal));
    for (int k = 0; k < 3; ++k) {
        normal[k] = length > 0.0 ? normal[k] / length : of->g[k];
    }
}

/* Texel centres lie at (i + ½) / N; lookups end at the image's edge. */
static double look_up(const task *t, const float *plane, double u, double v) {
    const int32_t size[2] = {t->image.width, t->image.height};
    const double place[2] = {u * size[0] - 0.5, (1.0 - v) * size[1] - 0.5};
    int32_t cell[2][2];
    double share[2];
    for (int k = 0; k < 2; ++k) {
        const double clamped = fmin(size[k] - 1.0, fmax(0.0, place[k]));
        cell[k][0] = (int32_t)clamped;
        cell[k][1] = cell[k][0] + 1 < size[k] ? cell[k][0] + 1 : cell[k][0];
        share[k] = clamped - cell[k][0];
    }
    double row[2];
    for (int y = 0; y < 2; ++y) {
        const float *from = plane + (size_t)cell[1][y] * (size_t)size[0];
        row[y] = (1.0 - share[0]) * (double)from[cell[0][0]] + share[0] * (double)from[cell[0][1]];
    }
    return (1.0 - share[1]) * row[0] + share[1] * row[1];
}

/* The answer of `rays` rays, spread by Vogel's spiral (directions.c) with a random turn and random radii. NAN
 * if no ray is above the face. */
static double trace(const task *t, int channel, size_t i, const double start[3], const double g[3],
                    const truth_frame *frame, size_t rays, uint64_t set) {
    const double turn = random_number(i, 3 + 4 * set + 2 * (uint64_t)channel);
    const double inset = random_number(i, 4 + 4 * set + 2 * (uint64_t)channel);
    const double radius = channel == SHADOW ? tan(t->half_angle) : 1.0;
    size_t above = 0, open = 0;
    for (size_t k = 0; k < rays; ++k) {
        const double angle = 2.0 * PI * (fmod((double)k * 0.38196601125010515, 1.0) + turn);
        const double r2 = ((double)k + inset) / (double)rays, r = radius * sqrt(r2);
        const double local[3] = {r * cos(angle), r * sin(angle), channel == SHADOW ? 1.0 : sqrt(1.0 - r2)};
        double towards[3];
        truth_to_world(frame, local, towards);
        if (dot(towards, g) > 0.0) {
            ++above;
            open +=
                !judge_hidden(&t->scene, start, towards, channel == SHADOW ? (double)INFINITY : t->distance);
        }
    }
    return channel == SHADOW ? (double)open / (double)rays
           : above > 0       ? (double)open / (double)above
                             : (double)NAN;
}

/* True if the sun's disc is on one side of both horizons, the face's and the smooth normal's. */
static bool is_clear_of_horizons(const task *t, const double g[3], const double n[3]) {
    const double limit = sin(t->half_angle), face = dot(t->sun.n, g), smooth = dot(t->sun.n, n);
    return dot(g, n) > 1.0 - 1e-6 || fmin(face, smooth) > limit || fmax(face, smooth) < -limit;
}

static void judge_points(void *user, size_t begin, size_t end) {
    const task *t = user;
    for (size_t i = begin; i < end; ++i) {
        point *p = &t->points[i];
        double normal[3] = {0}, start[3];
        place_point(t, i, p, normal);
        const double *g = t->scene.triangles[p->triangle].g;
        if (judge_verdict(&t->scene, p->at, g) != JUDGE_VALID) {
            continue;
        }
        for (int k = 0; k < 3; ++k) {
            start[k] = p->at[k] + t->scene.lift * g[k];
        }
        for (int c = 0; c < CHANNELS; ++c) {
            if (t->planes[c] == NULL || (c == SHADOW && !is_clear_of_horizons(t, g, normal))) {
                continue;
            }
            const truth_frame frame = c == SHADOW ? t->sun : truth_frame_around(normal);
            const double seen = look_up(t, t->planes[c], p->u, p->v);
            const double one = trace(t, c, i, start, g, &frame, RAYS, 0);
            const double two = trace(t, c, i, start, g, &frame, RAYS, 1);
            double truth = 0.5 * (one + two);
            if (fabs(seen - truth) > WRONG) {
                truth = trace(t, c, i, start, g, &frame, SURE_RAYS, 2);
            }
            p->channel[c] =
                (answer){isfinite(truth), (float)seen, (float)truth, (float)((seen - one) * (seen - two))};
        }
    }
}

/* --- report */

static void report(const task *t, int channel, const char *name, bool list) {
    size_t count[2] = {0}, dark[2] = {0}, bright[2] = {0}; /* [wide]: all points, points on wide charts */
    double square = 0.0;
    for (size_t i = 0; i < POINTS; ++i) {
        const point *p = &t->points[i];
        const answer *a = &p->channel[channel];
        const double error = (double)(a->seen - a->truth), width = t->width[p->triangle];
        for (int wide = 0; a->judged && wide <= (width >= WIDE); ++wide) {
            ++count[wide];
            dark[wide] += !(error >= -WRONG); /* a lookup that is not a number too */
            bright[wide] += error > WRONG;
        }
        square += a->judged ? (double)a->product : 0.0;
        if (list && a->judged && !(fabs(error) <= WRONG)) {
            const char *mesh = t->scene.meshes[t->scene.triangles[p->triangle].mesh].name;
            printf("%s %.3f instead of %.3f at texel %.2f, %.2f, chart %.1f texels wide, %s %.5f %.5f %.5f\n",
                   name, (double)a->seen, (double)a->truth, p->u * t->image.width - 0.5,
                   (1.0 - p->v) * t->image.height - 0.5, width, mesh != NULL ? mesh : "mesh", p->at[0],
                   p->at[1], p->at[2]);
        }
    }
    printf("seen_%s_rmse %.5f\n", name, sqrt(fmax(0.0, square) / (double)(count[0] > 0 ? count[0] : 1)));
    for (int wide = 0; wide < 2; ++wide) {
        const double percent = 100.0 / (double)(count[wide] > 0 ? count[wide] : 1);
        const char *part = wide ? "_wide" : "";
        printf("seen_%s%s_points %zu\nseen_%s%s_dark %.4f\nseen_%s%s_bright %.4f\n", name, part, count[wide],
               name, part, percent * (double)dark[wide], name, part, percent * (double)bright[wide]);
    }
}

/* Sums up the triangles' areas. Triangles of other meshes or without UVs count as 0. */
static void add_areas(task *t, const char *receive) {
    double sum = 0.0;
    for (size_t i = 0; i < t->scene.count; ++i) {
        const judge_triangle *of = &t->scene.triangles[i];
        const char *mesh = t->scene.meshes[of->mesh].name;
        const bool lit =
            isfinite(of->uv[0][0]) && (receive == NULL || (mesh != NULL && strcmp(mesh, receive) == 0));
        double a[3], b[3];
        for (int k = 0; k < 3; ++k) {
            a[k] = of->p[1][k] - of->p[0][k];
            b[k] = of->p[2][k] - of->p[0][k];
        }
        const double twice = dot(a, a) * dot(b, b) - dot(a, b) * dot(a, b);
        t->area[i] = sum += lit ? 0.5 * sqrt(fmax(0.0, twice)) : 0.0;
    }
    if (!(sum > 0.0)) {
        judge_give_up(receive != NULL ? receive : "the model", "no surface with lightmap UVs");
    }
}

int judge_seen(int count, char **arguments) {
    const char *solids = NULL, *receive = NULL;
    double towards[3] = {0}, angle = 0.0;
    int32_t uv_set = -1;
    bool sun = false, list = false, understood = count >= 2;
    task t = {0};
    for (int i = 2; i < count && understood; ++i) {
        const char *word = arguments[i], *value = i + 1 < count ? arguments[i + 1] : "";
        i += strcmp(word, "--list") != 0;
        if (strcmp(word, "--list") == 0) {
            list = true;
        } else if (strcmp(word, "--sun") == 0) {
            sun = understood = sscanf(value, "%lf,%lf,%lf", &towards[0], &towards[1], &towards[2]) == 3;
        } else if (strcmp(word, "--sun-angle") == 0) {
            understood = sscanf(value, "%lf", &angle) == 1;
        } else if (strcmp(word, "--ao") == 0) {
            understood = sscanf(value, "%lf", &t.distance) == 1;
        } else if (strcmp(word, "--uv-set") == 0) {
            understood = sscanf(value, "%d", &uv_set) == 1;
        } else if (strcmp(word, "--solids") == 0) {
            solids = strcmp(value, "-") != 0 ? value : NULL;
        } else if (strcmp(word, "--receive") == 0) {
            receive = value;
        } else {
            understood = false;
        }
    }
    if (!understood || (!sun && !(t.distance > 0.0))) {
        fputs("usage: the first lines of bench/judge_seen.c\n", stderr);
        return 2;
    }
    bake found = read_bake(arguments[1]);
    t.scene = judge_open(arguments[0], solids, uv_set, LIFT);
    t.image = found.image;
    t.planes[SHADOW] = sun ? plane_of(&found, "shadow.sun") : NULL;
    t.planes[AO] = t.distance > 0.0 ? plane_of(&found, "ao") : NULL;
    t.sun = truth_frame_around(sun ? towards : (double[]){0.0, 1.0, 0.0});
    t.half_angle = 0.5 * angle * PI / 180.0;
    t.area = judge_take(t.scene.count * sizeof *t.area);
    t.width = judge_take(t.scene.count * sizeof *t.width);
    t.points = judge_take(POINTS * sizeof *t.points);
    add_areas(&t, receive);
    measure_charts(&t);
    truth_in_pieces(POINTS, 0, judge_points, &t);
    if (sun) {
        report(&t, SHADOW, "shadow", list);
    }
    if (t.distance > 0.0) {
        report(&t, AO, "ao", list);
    }
    free(t.points);
    free(t.width);
    free(t.area);
    judge_close(&t.scene);
    vsh_image_free(found.file);
    return 0;
}
