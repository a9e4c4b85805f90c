/* Functions that replace callbacks which would be slow in other languages. */
#include "handles.h"

#include <pthread.h>
#include <stdatomic.h>

typedef struct heard {
    int calls, answer;
    double last;
    pthread_t thread;
} heard;

static int32_t listen(void *user, const char *stage, double fraction) {
    heard *h = user;
    assert_string_equal(stage, "stage");
    ++h->calls;
    h->last = fraction;
    h->thread = pthread_self();
    return h->answer;
}

static vshi_progress_filter filter_to(heard *h, double seconds) {
    return (vshi_progress_filter){sizeof(vshi_progress_filter), listen, h, seconds, 0, 0.0, 0};
}

TEST(progress_is_passed_on_at_both_ends_and_seldom_between) {
    heard h = {0, 0, 0.0, pthread_self()};
    vshi_progress_filter filter = filter_to(&h, 1e6);
    for (int i = 0; i <= 1000; ++i) {
        assert_int_equal(vshi_progress_seldom(&filter, "stage", 0.001 * i), 0);
    }
    assert_int_equal(h.calls, 2);
    assert_true(h.last == 1.0);
    filter.seconds = 0.0;
    assert_int_equal(vshi_progress_seldom(&filter, "stage", 0.5), 0);
    assert_int_equal(h.calls, 3);
    filter.progress = NULL;
    assert_int_equal(vshi_progress_seldom(&filter, "stage", 0.5), 0);
    assert_int_equal(vshi_progress_seldom(NULL, "stage", 0.5), 0);
}

TEST(an_answer_stays) {
    heard h = {0, 7, 0.0, pthread_self()};
    vshi_progress_filter filter = filter_to(&h, 0.02);
    assert_int_equal(vshi_progress_seldom(&filter, "stage", 0.0), 7);
    assert_int_equal(vshi_progress_seldom(&filter, "stage", 0.5), 7);
    assert_int_equal(h.calls, 1);
}

static void *tell(void *filter) {
    for (int i = 0; i <= 100; ++i) {
        vshi_progress_seldom(filter, "stage", 0.01 * i);
    }
    return NULL;
}

TEST(one_thread_alone_passes_progress_on) {
    heard h = {0, 0, 0.0, pthread_self()};
    vshi_progress_filter filter = filter_to(&h, 0.0);
    filter.thread = (uint64_t)pthread_self();
    pthread_t other;
    assert_int_equal(pthread_create(&other, NULL, tell, &filter), 0);
    assert_int_equal(pthread_join(other, NULL), 0);
    assert_int_equal(h.calls, 0);
    tell(&filter);
    assert_int_equal(h.calls, 101);
    assert_true(pthread_equal(h.thread, pthread_self()));
}

static double ring(void *user, const double p[3]) {
    return hypot(hypot(p[0], p[2]) - 0.7, p[1]) - 0.25;
}

static void rings(void *user, size_t count, const double *positions, double *distances) {
    atomic_int *largest = user;
    if ((int)count > atomic_load(largest)) {
        atomic_store(largest, (int)count);
    }
    for (size_t i = 0; i < count; ++i) {
        distances[i] = ring(NULL, positions + 3 * i);
    }
}

/* Compares every distance in a box around it, bit by bit. */
TEST(distances_of_many_positions_at_once_make_the_same_level_set) {
    const vsh_grid_options options = with_voxel(0.05);
    for (int exact = 0; exact < 2; ++exact) {
        atomic_int largest = 0;
        vsh_distance field = {ring, &largest, 1.0, exact, {-1, -0.3, -1}, {1, 0.3, 1}};
        vsh_grid *grids[2] = {grid_from_distance(&field, 0.05)};
        field.distance = NULL;
        assert_ok(vsh_grid_from_distances(&field, rings, &options, NULL, &grids[1], &failure));
        assert_int_equal(atomic_load(&largest), 64);
        const int32_t from[3] = {-24, -10, -24}, size[3] = {48, 20, 48};
        static float values[2][48 * 20 * 48];
        for (int i = 0; i < 2; ++i) {
            assert_ok(vsh_grid_copy(grids[i], from, size, values[i], &failure));
            vsh_grid_free(grids[i]);
        }
        assert_memory_equal(values[0], values[1], sizeof values[0]);
    }
}
