/* Judges bakes of models, for tools/judge-assets:
 *
 *   vsh_judge truth MODEL SIZE X,Y,Z DEGREES DISTANCE RAYS[:N] SOLIDS.obj|- OUT.exr
 *       verdict, shadow, ao, apart and triangle of every texel, or of one in N (judge.h)
 *   vsh_judge compare TRUTH.exr BAKE.exr [PICTURES.ppm]
 *       one line of figures (NAMES below says which), and a picture: shadow, its truth, error × 4; AO
 * likewise below vsh_judge alike BAKE.exr BAKE.exr RMSE between two bakes over texels that both have as
 * valid, shadow and ao, and texels that only one has
 */
#include "judge.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/vdbshade.h>

#define NAMES                                                                                                \
    "covered,valid,unclear,wrongly_invalid,wrongly_valid,shadow_rmse,shadow_bias,shadow_p99,shadow_max,ao_"  \
    "rmse,ao_bias,ao_p99,ao_max,black_texels,black_triangles,filled_shadow_rmse,filled_ao_rmse,apart,apart_" \
    "shadow_rmse,leaks"

static const float BLACK = 0.02f, BRIGHT = 0.5f; /* a mistake: a value below where truth is above */
static const float WRONG = 0.25f;                /* an error that is seen at a glance */
enum { BLACK_TRIANGLE = 4, LISTED = 40 };        /* texels of a triangle, at least, to call it black */

judge_bake judge_read_bake(const char *path) {
    vsh_error error;
    judge_bake b = {.path = path};
    if (vsh_image_read(path, NULL, &b.file, &error) != VSH_OK) {
        judge_give_up(path, error.message);
    }
    b.image = vsh_image_view(b.file);
    return b;
}

const float *judge_plane(const judge_bake *b, const char *name) {
    for (int32_t i = 0; i < b->image.channel_count; ++i) {
        if (strcmp(b->image.names[i], name) == 0) {
            return b->image.planes[i];
        }
    }
    fprintf(stderr, "judge: %s: no channel %s\n", b->path, name);
    exit(2);
}

static int truth(char **arguments) {
    judge_question q = {.size = atoi(arguments[1]),
                        .angle = atof(arguments[3]),
                        .distance = atof(arguments[4]),
                        .rays = atoi(arguments[5]),
                        .every = 1,
                        .solids = strcmp(arguments[6], "-") != 0 ? arguments[6] : NULL};
    vsh_error error;
    const char *every = strchr(arguments[5], ':');
    q.every = every != NULL ? atoi(every + 1) : 1;
    if (q.every < 1 ||
        sscanf(arguments[2], "%lf,%lf,%lf", &q.towards[0], &q.towards[1], &q.towards[2]) != 3 || q.size < 1 ||
        q.rays < 1) {
        fputs("judge: size, rays or direction\n", stderr);
        return 2;
    }
    judge_truth t = judge_make(arguments[0], &q);
    static const char *const names[] = {"verdict", "shadow", "ao", "apart", "triangle"};
    const float *const planes[] = {t.verdict, t.shadow, t.ao, t.apart, t.triangle};
    const vsh_image image = {q.size, q.size, 5, names, planes, NULL};
    if (fabs(t.units - 1.0) > 1e-3) {
        printf("%s: lengths are %.6g times what was meant\n", arguments[0], t.units);
    }
    if (vsh_image_write(arguments[7], &image, NULL, &error) != VSH_OK) {
        fprintf(stderr, "judge: %s\n", error.message);
        return 2;
    }
    judge_free(&t);
    return 0;
}

typedef struct sums {
    size_t count;
    double square, sum, max;
    size_t histogram[1001]; /* of absolute errors, in thousandths */
} sums;

static void add(sums *s, double error) {
    ++s->count;
    s->square += error * error;
    s->sum += error;
    s->max = fmax(s->max, fabs(error));
    ++s->histogram[(size_t)fmin(1000.0, floor(1000.0 * fabs(error)))];
}

static double rmse(const sums *s) {
    return s->count > 0 ? sqrt(s->square / (double)s->count) : 0.0;
}

static double p99(const sums *s) {
    size_t seen = 0;
    for (size_t i = 0; i <= 1000; ++i) {
        seen += s->histogram[i];
        if (100 * seen >= 99 * s->count) {
            return ((double)i + 0.5) / 1000.0;
        }
    }
    return 0.0;
}

typedef struct per_triangle {
    size_t texels, black;
    double light; /* sum of truth, the brighter of shadow and AO */
} per_triangle;

typedef struct judged {
    sums all[2], filled[2], apart;
    size_t covered, valid, unclear, wrongly_invalid, wrongly_valid, black, black_triangles, leaks;
} judged;

static judged judge(size_t count, const float *verdict, const float *apart, const float *triangle,
                    const float *const truths[2], const float *const values[2], const float *a) {
    judged j = {0};
    size_t triangles = 0;
    for (size_t i = 0; i < count; ++i) {
        triangles = fmaxf(triangle[i], 0.0f) > (float)triangles ? (size_t)triangle[i] : triangles;
    }
    per_triangle *each = judge_take((triangles + 1) * sizeof *each);
    for (size_t i = 0; i < count; ++i) {
        const int v = (int)verdict[i];
        j.covered += v != JUDGE_EMPTY;
        j.unclear += v == JUDGE_UNCLEAR;
        j.wrongly_valid += v == JUDGE_INVALID && a[i] > 0.0f;
        if (v != JUDGE_VALID) {
            continue;
        }
        ++j.valid;
        j.wrongly_invalid += a[i] < 1.0f;
        per_triangle *t = &each[(size_t)triangle[i]];
        ++t->texels;
        t->black += a[i] < 1.0f && values[0][i] < BLACK && values[1][i] < BLACK;
        t->light += (double)fmaxf(truths[0][i], truths[1][i]);
        bool black = false, leak = false;
        for (int c = 0; c < 2; ++c) {
            const float error = values[c][i] - truths[c][i];
            if (c == 0 && apart[i] > 0.0f) {
                add(&j.apart, (double)error);
                continue;
            }
            add(&j.all[c], (double)error);
            if (a[i] < 1.0f) {
                add(&j.filled[c], (double)error);
            }
            black = black || (values[c][i] < BLACK && truths[c][i] > BRIGHT);
            leak = leak || error > WRONG;
        }
        j.black += black;
        j.leaks += leak;
    }
    for (size_t t = 1; t <= triangles; ++t) {
        j.black_triangles += each[t].texels >= BLACK_TRIANGLE && each[t].black == each[t].texels &&
                             each[t].light > 0.1 * (double)each[t].texels;
    }
    free(each);
    return j;
}

/* Red: too bright; blue: too dark; green: invalid by mistake; yellow: valid by mistake; the rest grey. */
static void error_colour(float error, int verdict, bool valid, unsigned char rgb[3]) {
    const float e = fminf(1.0f, 4.0f * fabsf(error));
    const unsigned char c = (unsigned char)(e * 255.0f);
    memset(rgb, 0, 3);
    if (verdict == JUDGE_UNCLEAR || verdict == JUDGE_EMPTY) {
        memset(rgb, verdict == JUDGE_EMPTY ? 40 : 90, 3);
    } else if (verdict == JUDGE_INVALID) {
        memset(rgb, 60, 3);
        rgb[0] = rgb[1] = valid ? 230 : 60;
    } else {
        rgb[error > 0.0f ? 0 : 2] = c;
        rgb[1] = valid ? 0 : 130;
    }
}

static int paint(const char *path, int32_t width, int32_t height, const float *verdict,
                 const float *const truths[2], const float *const values[2], const float *a) {
    FILE *file = fopen(path, "wb");
    if (file == NULL) {
        fprintf(stderr, "judge: %s cannot be written\n", path);
        return 3;
    }
    unsigned char *row = judge_take(9 * (size_t)width);
    fprintf(file, "P6\n%d %d\n255\n", 3 * width, 2 * height);
    for (int32_t y = 0; y < 2 * height; ++y) {
        const int c = y >= height;
        for (int32_t x = 0; x < width; ++x) {
            const size_t i = (size_t)(y % height) * (size_t)width + (size_t)x;
            unsigned char *at = row + 3 * (size_t)x;
            memset(at, (int)(255.0f * fminf(1.0f, fmaxf(0.0f, values[c][i]))), 3);
            memset(at + 3 * width, (int)(255.0f * fminf(1.0f, fmaxf(0.0f, truths[c][i]))), 3);
            error_colour(values[c][i] - truths[c][i], (int)verdict[i], a[i] > 0.0f, at + 6 * width);
        }
        fwrite(row, 9, (size_t)width, file);
    }
    free(row);
    return fclose(file) == 0 ? 0 : 3;
}

static int compare(int count, char **arguments) {
    judge_bake t = judge_read_bake(arguments[0]), b = judge_read_bake(arguments[1]);
    if (t.image.width != b.image.width || t.image.height != b.image.height) {
        fprintf(stderr, "judge: %s and %s have not one size\n", t.path, b.path);
        return 2;
    }
    const size_t texels = (size_t)t.image.width * (size_t)t.image.height;
    const float *verdict = judge_plane(&t, "verdict"), *a = judge_plane(&b, "A");
    const float *const truths[2] = {judge_plane(&t, "shadow"), judge_plane(&t, "ao")};
    const float *const values[2] = {judge_plane(&b, "shadow.sun"), judge_plane(&b, "ao")};
    const judged j =
        judge(texels, verdict, judge_plane(&t, "apart"), judge_plane(&t, "triangle"), truths, values, a);
    printf("%zu,%zu,%zu,%zu,%zu", j.covered, j.valid, j.unclear, j.wrongly_invalid, j.wrongly_valid);
    for (int c = 0; c < 2; ++c) {
        printf(",%.5f,%.5f,%.4f,%.4f", rmse(&j.all[c]),
               j.all[c].count > 0 ? j.all[c].sum / (double)j.all[c].count : 0.0, p99(&j.all[c]),
               j.all[c].max);
    }
    printf(",%zu,%zu,%.5f,%.5f,%zu,%.5f,%zu\n", j.black, j.black_triangles, rmse(&j.filled[0]),
           rmse(&j.filled[1]), j.apart.count, rmse(&j.apart), j.leaks);
    const int result =
        count > 2 ? paint(arguments[2], t.image.width, t.image.height, verdict, truths, values, a) : 0;
    vsh_image_free(b.file);
    vsh_image_free(t.file);
    return result;
}

static int alike(char **arguments) {
    judge_bake o[2] = {judge_read_bake(arguments[0]), judge_read_bake(arguments[1])};
    const size_t texels = (size_t)o[0].image.width * (size_t)o[0].image.height;
    sums all[2] = {0};
    size_t lone = 0;
    if (o[0].image.width != o[1].image.width || o[0].image.height != o[1].image.height) {
        fputs("judge: not of one size\n", stderr);
        return 2;
    }
    for (size_t i = 0; i < texels; ++i) {
        const bool first = judge_plane(&o[0], "A")[i] > 0.0f, second = judge_plane(&o[1], "A")[i] > 0.0f;
        lone += first != second;
        for (int c = 0; first && second && c < 2; ++c) {
            const char *name = c == 0 ? "shadow.sun" : "ao";
            add(&all[c], (double)(judge_plane(&o[0], name)[i] - judge_plane(&o[1], name)[i]));
        }
    }
    printf("%.5f,%.5f,%zu\n", rmse(&all[0]), rmse(&all[1]), lone);
    vsh_image_free(o[0].file);
    vsh_image_free(o[1].file);
    return 0;
}

static int list(char **arguments) {
    vsh_error error;
    vsh_model *model = NULL;
    judge_bake t = judge_read_bake(arguments[0]), b = judge_read_bake(arguments[1]);
    if (vsh_model_read(arguments[2], NULL, &model, &error) != VSH_OK) {
        fprintf(stderr, "judge: %s\n", error.message);
        return 2;
    }
    const size_t mesh_count = vsh_model_mesh_count(model), width = (size_t)t.image.width;
    const size_t texels = width * (size_t)t.image.height;
    vsh_mesh *meshes = judge_take(mesh_count * sizeof *meshes);
    for (size_t m = 0; m < mesh_count; ++m) {
        meshes[m] = vsh_model_mesh(model, m, -1);
    }
    double low[3] = {0}, high[3] = {0};
    size_t count, wrong = 0;
    judge_triangle *triangles = judge_take_triangles(meshes, mesh_count, &count, low, high);
    size_t *found = judge_take(texels * sizeof *found);
    const float *verdict = judge_plane(&t, "verdict"), *triangle = judge_plane(&t, "triangle"),
                *apart = judge_plane(&t, "apart");
    const float *const truths[2] = {judge_plane(&t, "shadow"), judge_plane(&t, "ao")};
    const float *const values[2] = {judge_plane(&b, "shadow.sun"), judge_plane(&b, "ao")},
                       *a = judge_plane(&b, "A");
    for (size_t i = 0; i < texels; ++i) {
        const int v = (int)verdict[i];
        const bool off = (apart[i] == 0.0f && fabsf(values[0][i] - truths[0][i]) > WRONG) ||
                         fabsf(values[1][i] - truths[1][i]) > WRONG;
        if ((v == JUDGE_INVALID && a[i] > 0.0f) || (v == JUDGE_VALID && (a[i] < 1.0f || off))) {
            found[wrong++] = i;
        }
    }
    for (size_t k = 0; k < wrong; k += wrong / LISTED + 1) {
        const size_t i = found[k];
        const judge_triangle *at = &triangles[(size_t)triangle[i] - 1];
        double p[3];
        judge_position(at, (double)(i % width) + 0.5, (double)(i / width) + 0.5, t.image.width, p, NULL);
        printf("%4zu %4zu  at %.5f %.5f %.5f  normal %.3f %.3f %.3f  %s  shadow %.3f, truth %.3f  AO %.3f, "
               "truth %.3f\n",
               i % width, i / width, p[0], p[1], p[2], at->g[0], at->g[1], at->g[2],
               (int)verdict[i] == JUDGE_INVALID ? "valid by mistake  "
               : a[i] < 1.0f                    ? "invalid by mistake"
                                                : "off               ",
               (double)values[0][i], (double)truths[0][i], (double)values[1][i], (double)truths[1][i]);
    }
    printf("%zu texels\n", wrong);
    free(found);
    free(triangles);
    free(meshes);
    vsh_model_free(model);
    vsh_image_free(b.file);
    vsh_image_free(t.file);
    return 0;
}

/* Which mesh of a model an error is of: triangles are numbered as judge_take_triangles() takes them. */
static int blame(char **arguments) {
    typedef struct share {
        size_t texels, invalid, valid, black;
        double square[2];
    } share;
    vsh_error error;
    vsh_model *model = NULL;
    judge_bake t = judge_read_bake(arguments[0]), b = judge_read_bake(arguments[1]);
    if (vsh_model_read(arguments[2], NULL, &model, &error) != VSH_OK) {
        fprintf(stderr, "judge: %s\n", error.message);
        return 2;
    }
    const size_t meshes = vsh_model_mesh_count(model),
                 texels = (size_t)t.image.width * (size_t)t.image.height;
    size_t *end = judge_take((meshes + 1) * sizeof *end);
    share *shares = judge_take(meshes * sizeof *shares);
    for (size_t m = 0; m < meshes; ++m) {
        const vsh_mesh mesh = vsh_model_mesh(model, m, -1);
        double low[3] = {0}, high[3] = {0};
        size_t count;
        free(judge_take_triangles(&mesh, 1, &count, low, high));
        end[m + 1] = end[m] + count;
    }
    const float *verdict = judge_plane(&t, "verdict"), *triangle = judge_plane(&t, "triangle"),
                *apart = judge_plane(&t, "apart");
    const float *const truths[2] = {judge_plane(&t, "shadow"), judge_plane(&t, "ao")};
    const float *const values[2] = {judge_plane(&b, "shadow.sun"), judge_plane(&b, "ao")},
                       *a = judge_plane(&b, "A");
    for (size_t i = 0; i < texels; ++i) {
        const int v = (int)verdict[i];
        size_t m = 0;
        if (v == JUDGE_EMPTY || triangle[i] < 1.0f) {
            continue;
        }
        while (m + 1 < meshes && (size_t)triangle[i] > end[m + 1]) {
            ++m;
        }
        ++shares[m].texels;
        shares[m].valid += v == JUDGE_INVALID && a[i] > 0.0f;
        shares[m].invalid += v == JUDGE_VALID && a[i] < 1.0f;
        for (int c = 0; c < 2 && v == JUDGE_VALID; ++c) {
            if (c == 0 && apart[i] > 0.0f) {
                continue;
            }
            const double e = (double)(values[c][i] - truths[c][i]);
            shares[m].square[c] += e * e;
            shares[m].black += values[c][i] < BLACK && truths[c][i] > BRIGHT;
        }
    }
    for (size_t m = 0; m < meshes; ++m) {
        printf("%-16s %7zu texels, %6zu invalid and %6zu valid by mistake, %6zu black, squares of shadow "
               "%9.2f, AO %9.2f\n",
               vsh_model_mesh(model, m, -1).name, shares[m].texels, shares[m].invalid, shares[m].valid,
               shares[m].black, shares[m].square[0], shares[m].square[1]);
    }
    free(shares);
    free(end);
    vsh_model_free(model);
    vsh_image_free(b.file);
    vsh_image_free(t.file);
    return 0;
}

int main(int argc, char **argv) {
    if (argc == 10 && strcmp(argv[1], "truth") == 0) {
        return truth(argv + 2);
    }
    if ((argc == 4 || argc == 5) && strcmp(argv[1], "compare") == 0) {
        return compare(argc - 2, argv + 2);
    }
    if (argc == 5 && strcmp(argv[1], "blame") == 0) {
        return blame(argv + 2);
    }
    if (argc == 5 && strcmp(argv[1], "list") == 0) {
        return list(argv + 2);
    }
    if (argc == 4 && strcmp(argv[1], "alike") == 0) {
        return alike(argv + 2);
    }
    if (argc >= 2 && strcmp(argv[1], "seen") == 0) {
        return judge_seen(argc - 2, argv + 2);
    }
    if (argc == 2 && strcmp(argv[1], "names") == 0) {
        puts(NAMES);
        return 0;
    }
    fputs("usage: the first lines of bench/judge.c\n", stderr);
    return 2;
}
