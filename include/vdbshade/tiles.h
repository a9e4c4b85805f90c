/* Worlds in tiles: a scene that does not fit into memory as several that do, each of some of its receivers
 * and of the casters that their light and their open sky can meet (docs/farm.md). */
#ifndef VDBSHADE_TILES_H
#define VDBSHADE_TILES_H

#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The tiles of a scene. Immutable; may be shared by threads. */
typedef struct vsh_tiles vsh_tiles;

/* Sorts a scene's receivers into cubes of `size` world units (finite, > 0), each by the middle of its box,
 * and looks where its casters are. Models are read one at a time and let go again; of .vdb files only what
 * they say of themselves is read. Warns (run->warning) of receivers larger than two tiles, as none is cut.
 * The scene must outlive the tiles, and neither it nor what it points to may change meanwhile. Free them
 * with vsh_tiles_free(). Errors:
 * - VSH_ERROR_ARGUMENT: a pointer NULL, a size out of range, no receivers, a scene that takes its fields from
 *   a file or is a tile itself, run;
 * - VSH_ERROR_INPUT: a pattern that matches no mesh of its file, or leaves none;
 * - as vsh_model_read() and vsh_vdb_list(), and of heightfields that receive as vsh_assets_load();
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_tiles_create(const vsh_scene *scene, double size, const vsh_run *run,
                                    vsh_tiles **tiles, vsh_error *error);
VSH_API void vsh_tiles_free(vsh_tiles *tiles); /* NULL does nothing */

/* How many there are, at least 1, in the order of their first receivers. Cannot fail. */
VSH_API size_t vsh_tiles_count(const vsh_tiles *tiles);

/* One of them: what vsh_scene.tile points to. Immutable. */
typedef struct vsh_tile vsh_tile;

/* Finds what casts in tile `index`:
 * - objects of mesh casters that a ray from the box of the tile's receivers towards a light, or within
 *   ao_distance, can meet. Of them the smallest and farthest are left out, too, for as long as all that is
 *   left out cannot hide more of any light or of the open sky than a tenth of scene->shade.max_error;
 * - of .vdb casters the leaves in a box around those rays and the cones around them;
 * - every other caster.
 * So a tile's values are the whole scene's to within the error asked for: but for that tenth, for voxels
 * where none are named by their size, and for how far off their surfaces rays begin, which goes by the
 * size of what casts, as a float's rounding does. The tiles must outlive it. Free it with vsh_tile_free().
 * Errors: VSH_ERROR_ARGUMENT (a pointer NULL, no such tile), VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_tile_create(const vsh_tiles *tiles, size_t index, vsh_tile **tile, vsh_error *error);
VSH_API void vsh_tile_free(vsh_tile *tile); /* NULL does nothing */

/* A tile as a scene of its own, for vsh_assets_load(), vsh_bake_scene() and all else that takes one: the
 * whole scene's lights and options, some of its receivers in their order, and all of its casters, of which
 * only what was said above is loaded. It belongs to the tile. Cannot fail. */
VSH_API const vsh_scene *vsh_tile_scene(const vsh_tile *tile);

/* What a tile comes to. */
typedef struct vsh_tile_info {
    size_t receivers;     /* how many */
    double bounds_min[3]; /* world box of its receivers */
    double bounds_max[3];
    size_t objects;     /* of mesh casters, that cast in it */
    uint64_t triangles; /* of them */
    double left_out;    /* the most that what was left out can hide of a light or of the open sky, 0 … 1 */
    size_t all_objects; /* of the whole scene's mesh casters */
    uint64_t all_triangles; /* of them */
} vsh_tile_info;

/* Cannot fail. */
VSH_API void vsh_tile_get_info_sized(const vsh_tile *tile, vsh_tile_info *info, size_t info_size);
static inline void vsh_tile_get_info(const vsh_tile *tile, vsh_tile_info *info) {
    vsh_tile_get_info_sized(tile, info, sizeof *info);
}

#ifdef __cplusplus
}
#endif
#endif
