/* Least squares within limits: what is found meets the conditions of a minimum (Karush, Kuhn and Tucker). */
#include "testing.h"

#include "bake/seams.h"

enum { UNKNOWNS = 600, ROWS = 900, FIRST = 1000 };

typedef struct system {
    vshi_seam_row rows[ROWS];
    double values[UNKNOWNS], low[UNKNOWNS], high[UNKNOWNS], keep[UNKNOWNS], gradient[UNKNOWNS],
        change[UNKNOWNS];
    double work[VSHI_SEAM_WORK * UNKNOWNS];
    vshi_seam_problem problem;
} system_of_rows;

static double random_of(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) * 0x1p-24;
}

/* Rows between texels near each other, as along a border; `limit` of each change. */
static system_of_rows *new_system(uint32_t seed, double limit, double keep, vshi_job *job) {
    system_of_rows *s = calloc(1, sizeof *s);
    for (size_t r = 0; r < ROWS; ++r) {
        const size_t at = r * (UNKNOWNS / 2 - 4) / ROWS;
        float left = 1.0f;
        for (size_t k = 0; k < VSHI_SEAM_READS; ++k) {
            const float weight = k % 4 == 3 ? left : 0.25f * (float)(int)(3.0 * random_of(&seed)) * left;
            left = k % 4 == 3 ? 1.0f : left - weight;
            s->rows[r].unknown[k] = (uint32_t)(FIRST + at + k % 4 + (k < 4 ? 0 : UNKNOWNS / 2));
            s->rows[r].weight[k] = k < 4 ? weight : -weight;
        }
        s->rows[r].share = 0.25f + (float)random_of(&seed);
    }
    for (size_t u = 0; u < UNKNOWNS; ++u) {
        s->values[u] = random_of(&seed);
        s->low[u] = u % 7 == 0 ? 0.0 : -limit;
        s->high[u] = u % 11 == 0 ? 0.0 : limit;
        s->keep[u] = keep * (u % 5 == 0 ? 0.1 : 1.0);
    }
    s->problem = (vshi_seam_problem){.rows = s->rows,
                                     .row_count = ROWS,
                                     .unknown_count = UNKNOWNS,
                                     .first = FIRST,
                                     .low = s->low,
                                     .high = s->high,
                                     .keep = s->keep,
                                     .gradient = s->gradient,
                                     .change = s->change,
                                     .work = s->work,
                                     .job = job};
    vshi_seam_gradient(&s->problem, s->values, s->gradient);
    return s;
}

/* The gradient where the changes are, by the definition. */
static void gradient_at(const system_of_rows *s, double *gradient) {
    for (size_t u = 0; u < UNKNOWNS; ++u) {
        gradient[u] = s->keep[u] * s->change[u];
    }
    for (size_t r = 0; r < ROWS; ++r) {
        double difference = 0.0;
        for (size_t k = 0; k < VSHI_SEAM_READS; ++k) {
            const size_t u = s->rows[r].unknown[k] - FIRST;
            difference += (double)s->rows[r].weight[k] * (s->values[u] + s->change[u]);
        }
        for (size_t k = 0; k < VSHI_SEAM_READS; ++k) {
            gradient[s->rows[r].unknown[k] - FIRST] +=
                (double)s->rows[r].share * (double)s->rows[r].weight[k] * difference;
        }
    }
}

TEST(what_is_found_is_the_minimum_within_the_limits) {
    const double limits[] = {0.0, 0.01, 0.1, 0.4, 10.0};
    vshi_job *job = vshi_job_begin(NULL, "seams", 1);
    for (size_t l = 0; l < sizeof limits / sizeof limits[0]; ++l) {
        for (uint32_t seed = 0; seed < 20; ++seed) {
            FREED system_of_rows *s = new_system(seed, limits[l], 0.01, job);
            const int steps = vshi_seam_solve(&s->problem);
            double gradient[UNKNOWNS], first = 0.0, left = 0.0;
            gradient_at(s, gradient);
            size_t held = 0;
            for (size_t u = 0; u < UNKNOWNS; ++u) {
                assert_true(s->change[u] >= s->low[u] && s->change[u] <= s->high[u]);
                const double down = s->change[u] > s->low[u] ? fmax(gradient[u], 0.0) : 0.0;
                const double up = s->change[u] < s->high[u] ? fmin(gradient[u], 0.0) : 0.0;
                held += down == 0.0 && up == 0.0 && gradient[u] != 0.0;
                left += down * down + up * up;
                first += s->gradient[u] * s->gradient[u];
            }
            assert_true(sqrt(left) <= 1.01e-4 * sqrt(first));
            assert_true(limits[l] == 0.0 || limits[l] > 0.2 || held > UNKNOWNS / 4);
            assert_true(limits[l] > 0.0 || steps == 0);
        }
    }
    vshi_job_end(job);
}

/* Plain gradient steps take thousands. */
TEST(a_stiff_system_takes_some_hundred_steps) {
    vshi_job *job = vshi_job_begin(NULL, "seams", 1);
    for (uint32_t seed = 0; seed < 8; ++seed) {
        FREED system_of_rows *s = new_system(seed, 1e6, 1e-3, job);
        for (size_t u = 0; u < UNKNOWNS; ++u) {
            s->low[u] = -1e6;
            s->high[u] = 1e6;
        }
        const int steps = vshi_seam_solve(&s->problem);
        assert_in_range(steps, 5, 700);
    }
    vshi_job_end(job);
}
