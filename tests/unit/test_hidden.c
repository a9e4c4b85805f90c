/* Charts hidden where surfaces touch: vsh_lightmap_fill_hidden(). */
#include "handles.h"
#include "seams.h"

/* Three squares of the plane z = 0 in a row, each a chart of 12 texels: the middle one is hidden. A fourth
 * is near the first in the lightmap, and far away in the world. */
enum { SEEN, HIDDEN_CHART, ACROSS, FAR, CHARTS, CHART_TEXELS = 12 };

static const double corners[CHARTS][2] = {{4, 20}, {24, 20}, {44, 20}, {24, 37}};

static charts_mesh *four_squares(void) {
    charts_mesh *m = new_mesh();
    for (int c = 0; c < CHARTS; ++c) {
        add_square(m, c == FAR ? 40.0 : c, corners[c], CHART_TEXELS, 0.0, 1.0);
    }
    return m;
}

/* A lightmap of squares with all but one of its charts seen. */
typedef struct stage {
    charts_mesh *mesh;
    vsh_charts *charts;
    float *ao, *coverage, *light;
} stage;

/* Column and row of a texel in its chart (v downwards); -1: outside. */
static int chart_at(size_t texel, int *column, int *row) {
    const int x = (int)(texel % SIDE), y = (int)(texel / SIDE);
    for (int c = 0; c < CHARTS; ++c) {
        *column = x - (int)corners[c][0];
        *row = y - ((int)corners[c][1] - CHART_TEXELS);
        if (*column >= 0 && *column < CHART_TEXELS && *row >= 0 && *row < CHART_TEXELS) {
            return c;
        }
    }
    return -1;
}

/* 100 × chart + column + row / 100 where it is valid. */
static float value_of(int chart, int column, int row) {
    return (float)(100 * (chart + 1) + column) + (float)row / 100.0F;
}

/* `half`: the first columns of the hidden chart are seen, too. */
static stage begin_with(charts_mesh *mesh, int32_t padding, bool half) {
    stage s = {mesh, NULL, new_plane(0.0F), new_plane(0.0F), calloc(3 * TEXELS, sizeof(float))};
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = SIDE;
    options.padding = padding;
    s.charts = charts_from(&mesh->mesh, 1, &options);
    for (size_t i = 0; i < TEXELS; ++i) {
        int column, row;
        const int chart = chart_at(i, &column, &row);
        const bool valid = chart >= 0 && (chart != HIDDEN_CHART || (half && column < 3));
        s.coverage[i] = valid ? 1.0F : 0.0F;
        s.ao[i] = valid ? value_of(chart, column, row) : -1.0F;
        s.light[3 * i + 2] = s.ao[i];
    }
    return s;
}

static stage begin(int32_t padding, bool half) {
    return begin_with(four_squares(), padding, half);
}

static void end(stage *s) {
    free(s->ao);
    free(s->coverage);
    free(s->light);
    vsh_charts_free(s->charts);
    free(s->mesh);
}

static uint64_t fill(const stage *s, int32_t threads) {
    const vsh_lightmap map = {.ao = s->ao, .coverage = s->coverage, .irradiance = s->light};
    const vsh_run run = run_on(threads);
    uint64_t filled = UINT64_MAX;
    assert_ok(vsh_lightmap_fill_hidden(s->charts, &map, 0, &run, &filled, &failure));
    return filled;
}

static void assert_value(const stage *s, size_t texel, float expected) {
    assert_that(s->ao[texel] == expected, "texel %zu: %g, expected %g", texel, (double)s->ao[texel],
                (double)expected);
}

TEST(a_hidden_chart_gets_the_nearest_values_of_the_world) {
    FREED_BY(end) stage s = begin(2, false);
    assert_int_equal(fill(&s, 1), CHART_TEXELS * CHART_TEXELS);
    for (size_t i = 0; i < TEXELS; ++i) {
        int column, row;
        const int chart = chart_at(i, &column, &row);
        assert_true(s.light[3 * i + 2] == s.ao[i] && s.light[3 * i] == 0);
        if (chart >= 0) {
            /* the left half that of the last column before it, the right half that of the first after it */
            const bool left = column < CHART_TEXELS / 2;
            assert_value(&s, i,
                         chart != HIDDEN_CHART ? value_of(chart, column, row)
                         : left                ? value_of(SEEN, CHART_TEXELS - 1, row)
                                               : value_of(ACROSS, 0, row));
            assert_true(s.coverage[i] == (chart != HIDDEN_CHART));
        }
    }
}

TEST(empty_texels_are_padded_from_the_nearest_chart) {
    for (int32_t padding = 0; padding <= 6; padding += 2) {
        FREED_BY(end) stage s = begin(padding, false);
        fill(&s, 1);
        const int reach = padding < 4 ? padding : 4, x = 24, y = 8; /* the chart's first texel */
        for (int d = 1; d <= 6; ++d) {
            const size_t left = (size_t)(y + 5) * SIDE + (size_t)(x - d);
            const size_t above = (size_t)(y - d) * SIDE + (size_t)(x + 2);
            assert_value(&s, above, d <= reach ? value_of(SEEN, CHART_TEXELS - 1, 0) : -1.0F);
            assert_value(&s, left, d <= reach ? value_of(SEEN, CHART_TEXELS - 1, 5) : -1.0F);
        }
        /* five texels lie between it and the far one below: the middle one is of the one before */
        for (int d = 0; d < 5; ++d) {
            const size_t below = (size_t)(20 + d) * SIDE + (size_t)(x + 2);
            if (d != 2) {
                assert_value(&s, below,
                             d < 2 && d < reach ? value_of(SEEN, CHART_TEXELS - 1, CHART_TEXELS - 1) : -1.0F);
            }
        }
    }
}

TEST(a_chart_in_part_hidden_keeps_its_own_values_near_seen_texels) {
    FREED_BY(end) stage s = begin(2, true);
    int column, row;
    for (size_t i = 0; i < TEXELS; ++i) { /* as the bake fills them */
        if (chart_at(i, &column, &row) == HIDDEN_CHART && column >= 3) {
            s.ao[i] = s.light[3 * i + 2] = value_of(HIDDEN_CHART, 2, row);
        }
    }
    fill(&s, 1);
    for (size_t i = 0; i < TEXELS; ++i) {
        if (chart_at(i, &column, &row) == HIDDEN_CHART && column >= 3) {
            /* the seen texel across (12 - column away) is less than half as far as its own chart's (column -
             * 2) */
            const bool across = 2 * (12 - column) < column - 2;
            assert_value(&s, i, across ? value_of(ACROSS, 0, row) : value_of(HIDDEN_CHART, 2, row));
        }
    }
}

/* The square that is across lies over the hidden one from its fifth column on. */
TEST(lookups_beside_seen_texels_read_the_charts_own_values) {
    charts_mesh *m = new_mesh();
    static const double places[CHARTS] = {0.0, 1.0, 1.0 + 4.0 / CHART_TEXELS, 40.0};
    for (int c = 0; c < CHARTS; ++c) {
        add_square(m, places[c], corners[c], CHART_TEXELS, 0.0, 1.0);
    }
    FREED_BY(end) stage s = begin_with(m, 2, true);
    const int row = 5;
    const size_t first = (size_t)(8 + row) * SIDE + 24;
    for (size_t column = 3; column < CHART_TEXELS; ++column) {
        s.ao[first + column] = value_of(HIDDEN_CHART, 2, row);
    }
    fill(&s, 1);
    for (size_t column = 3; column < 8; ++column) {
        assert_value(&s, first + column,
                     column == 5 ? value_of(ACROSS, 0, row) : value_of(HIDDEN_CHART, 2, row));
    }
}

TEST(nothing_changes_where_all_is_seen_or_nothing) {
    for (int seen = 0; seen < 2; ++seen) {
        FREED_BY(end) stage s = begin(2, false), before = begin(2, false);
        for (size_t i = 0; i < TEXELS; ++i) {
            s.coverage[i] = (float)seen;
        }
        assert_int_equal(fill(&s, 1), 0);
        assert_memory_equal(s.ao, before.ao, TEXELS * sizeof *s.ao);
    }
}

static int32_t stop(void *user, const char *step, double fraction) {
    return 1;
}

TEST(threads_change_nothing_nor_do_calls_that_fail) {
    FREED_BY(end) stage s = begin(2, false), other = begin(2, false);
    fill(&s, 1);
    const vsh_lightmap map = {.ao = other.ao, .coverage = other.coverage}, none = {.ao = other.ao};
    const vsh_run limited = run_within(1000), stopped = run_watched(stop, NULL);
    assert_fails(vsh_lightmap_fill_hidden(other.charts, &map, 0, &limited, NULL, &failure), VSH_ERROR_LIMIT,
                 "hidden charts");
    assert_fails(vsh_lightmap_fill_hidden(other.charts, &map, 0, &stopped, NULL, &failure),
                 VSH_ERROR_CANCELLED, "");
    assert_fails(vsh_lightmap_fill_hidden(other.charts, &none, 0, NULL, NULL, &failure), VSH_ERROR_ARGUMENT,
                 "");
    fill(&other, 4);
    assert_memory_equal(s.ao, other.ao, TEXELS * sizeof *s.ao);
}
