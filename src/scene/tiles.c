/* A scene's receivers in tiles. */
#include "base/error.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "scene/tile.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct celled {
    double cell[3];
    size_t index; /* of the receiver */
    size_t tile;  /* the first receiver in its cell */
} celled;

static int compare_cells(const celled *a, const celled *b) {
    for (int axis = 0; axis < 3; ++axis) {
        if (a->cell[axis] != b->cell[axis]) {
            return a->cell[axis] < b->cell[axis] ? -1 : 1;
        }
    }
    return 0;
}

static int by_cell(const void *left, const void *right) {
    const celled *a = left, *b = right;
    const int order = compare_cells(a, b);
    return order != 0 ? order : a->index < b->index ? -1 : 1;
}

static int by_tile(const void *left, const void *right) {
    const celled *a = left, *b = right;
    if (a->tile != b->tile) {
        return a->tile < b->tile ? -1 : 1;
    }
    return a->index < b->index ? -1 : 1;
}

static vsh_result sort_receivers(vsh_tiles *tiles, double size, vsh_error *error) {
    const size_t count = tiles->whole->receiver_count;
    celled *cells = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&cells, count, sizeof *cells, "receivers", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&tiles->receivers, count, sizeof *tiles->receivers, "tiles", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&tiles->first, count + 1, sizeof *tiles->first, "tiles", error));
    for (size_t i = 0; i < count; ++i) {
        const vshi_world_box *box = &tiles->survey.receivers[i];
        cells[i].index = i;
        for (int axis = 0; axis < 3; ++axis) {
            cells[i].cell[axis] = floor((0.5 * box->low[axis] + 0.5 * box->high[axis]) / size);
        }
    }
    qsort(cells, count, sizeof *cells, by_cell);
    for (size_t i = 0; i < count; ++i) {
        const bool same = i > 0 && compare_cells(&cells[i], &cells[i - 1]) == 0;
        cells[i].tile = same ? cells[i - 1].tile : cells[i].index;
    }
    qsort(cells, count, sizeof *cells, by_tile);
    for (size_t i = 0; i < count; ++i) {
        if (i == 0 || cells[i].tile != cells[i - 1].tile) {
            tiles->first[tiles->count++] = i;
        }
        tiles->receivers[i] = cells[i].index;
    }
    tiles->first[tiles->count] = count;
done:
    free(cells);
    return result;
}

static double longest_side(const vshi_world_box *box) {
    double longest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        longest = fmax(longest, box->high[axis] - box->low[axis]);
    }
    return longest;
}

/* Receivers are not cut: one that reaches far beyond its tile takes with it all that it can meet there. */
static void warn_of_large(const vsh_tiles *tiles, double size, const vsh_run *run) {
    size_t count = 0, largest = 0;
    double longest = 2.0 * size;
    for (size_t i = 0; i < tiles->whole->receiver_count; ++i) {
        const double side = longest_side(&tiles->survey.receivers[i]);
        count += side > 2.0 * size;
        if (side > longest) {
            longest = side;
            largest = i;
        }
    }
    if (count > 0) {
        const char *output = tiles->whole->receivers[largest].output;
        vshi_note(
            run,
            "%zu of %zu receivers are larger than two tiles of %g ('%s' is the largest, with %g units): "
            "what casts on such a one is loaded all at once; give its pieces lightmaps of their own",
            count, tiles->whole->receiver_count, size, output != NULL ? output : "", longest);
    }
}

vsh_result vsh_tiles_create(const vsh_scene *scene, double size, const vsh_run *run, vsh_tiles **tiles,
                            vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(tiles);
    *tiles = NULL;
    VSHI_NEEDS(scene);
    if (!(size > 0.0 && isfinite(size))) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "tiles: size %g: expected a finite number above 0", size);
    }
    if (scene->receiver_count == 0 || scene->field != NULL || scene->tile != NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "tiles: the scene %s",
                         scene->receiver_count == 0 ? "has no receivers"
                         : scene->field != NULL     ? "takes its fields from a file, which are of all casters"
                                                    : "is a tile already");
    }
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vsh_tiles *made;
    VSHI_TRY(vshi_allocate((void **)&made, 1, sizeof *made, "tiles", error));
    made->whole = scene;
    vsh_result result;
    VSHI_TRY_DONE(vshi_reach_make(scene, &made->reach, error));
    VSHI_TRY_DONE(vshi_survey_make(scene, &full, &made->survey, error));
    VSHI_TRY_DONE(sort_receivers(made, size, error));
    warn_of_large(made, size, &full);
    *tiles = made;
    made = NULL;
done:
    vsh_tiles_free(made);
    return result;
}

void vsh_tiles_free(vsh_tiles *tiles) {
    if (tiles == NULL) {
        return;
    }
    free(tiles->first);
    free(tiles->receivers);
    vshi_survey_free(&tiles->survey);
    vshi_reach_free(&tiles->reach);
    free(tiles);
}

size_t vsh_tiles_count(const vsh_tiles *tiles) {
    return tiles->count;
}
