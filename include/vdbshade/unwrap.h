/* Lightmap UVs: charts of triangles laid out flat, and packed into the pages of an atlas. */
#ifndef VDBSHADE_UNWRAP_H
#define VDBSHADE_UNWRAP_H

#include "mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VSH_MAX_PAGES = 1024, VSH_MAX_PAGE_SIZE = 65536 };

/* Which UVs charts are made of. */
enum {
    VSH_UNWRAP_ALWAYS = 0, /* those that are laid out here */
    VSH_UNWRAP_KEEP = 1    /* a mesh's own, where vsh_uvs_usable() finds nothing wrong with them: what hangs
                              together in them is a chart, and is packed as it is; else as VSH_UNWRAP_ALWAYS */
};

/* What lies on one page. */
enum {
    VSH_ATLAS_SHARED = 0, /* charts of any mesh */
    VSH_ATLAS_OBJECTS = 1 /* those of one object, which are meshes in a row of one vsh_mesh.object above 0, or
                             a single mesh */
};

/* How meshes are unwrapped. */
typedef struct vsh_unwrap_options {
    size_t struct_size;
    int32_t width;     /* texels of each page, 1 … VSH_MAX_PAGE_SIZE */
    int32_t height;    /* the same */
    int32_t max_pages; /* 1 … VSH_MAX_PAGES; 1 with VSH_ATLAS_OBJECTS: each object has one */
    int32_t padding;   /* free texels between those that two charts touch, along rows and columns, 0 … 4096;
                          what is before a page's border is no chart, and needs none */
    double texels_per_unit; /* texels along a world unit, finite, ≥ 0; 0: the greatest at which everything
                               fits into max_pages, to some hundredths */
    const double *density;  /* [mesh_count] factors of texels_per_unit, finite, > 0; NULL: all 1 */
    double max_stretch;     /* L2 stretch (vsh_atlas_chart) that no chart exceeds, ≥ 1.01; charts are split
                               until none does */
    int32_t keep_uvs;       /* VSH_UNWRAP_… */
    int32_t atlas; /* VSH_ATLAS_…; of objects without texels_per_unit each has the greatest that fits its own
                      page */
    int32_t fit_pages; /* nonzero, with texels_per_unit: `width` × `height` is what a page may have at most.
                          It has the fewest texels that what lies on it fits into, of sides that are powers of
                          two (or the given ones), and at most twice as long as each other where those are */
} vsh_unwrap_options;

static inline vsh_unwrap_options vsh_unwrap_options_default(void) {
    vsh_unwrap_options options = {
        sizeof(vsh_unwrap_options), 1024, 1024, 1, 4, 0.0, NULL, 1.3, VSH_UNWRAP_ALWAYS, VSH_ATLAS_SHARED, 0};
    return options;
}

/* The chart of a triangle that is in none. */
#define VSH_NO_CHART UINT32_MAX

/* One mesh as it lies in the atlas. The arrays belong to the atlas. Triangles are those of the mesh in its
 * order, and the corners of each in its order; no vertex is in two charts. */
typedef struct vsh_atlas_mesh {
    const float *uvs; /* [vertex_count][2], 0 … 1 of the chart's page, v up; triangles run anticlockwise */
    const uint32_t *sources; /* [vertex_count]: the vertex of the mesh that each is a copy of */
    const uint32_t *indices; /* [triangle_count][3], each < vertex_count */
    const uint32_t *charts;  /* [triangle_count]: number in vsh_atlas_charts(); VSH_NO_CHART: of a triangle
                                without area, whose corners are at (0, 0) */
    size_t vertex_count;
    size_t triangle_count;
} vsh_atlas_mesh;

/* A chart of an atlas. */
typedef struct vsh_atlas_chart {
    uint32_t page;  /* that it lies on, from 0 */
    uint32_t mesh;  /* that it was cut from */
    float stretch;  /* root of the mean of the squared stretch of all directions from texture to surface, over
                       the chart's area, for UVs of the surface's area: 1 is isometric (Sander and others,
                       "Texture mapping progressive meshes", 2001, L2) */
    int32_t min[2]; /* texels that it touches: first column and row, row 0 at v = 0 */
    int32_t max[2]; /* and those after the last */
    double area;    /* of its triangles, world units² */
} vsh_atlas_chart;

/* A page has charts; an object without any has none. */
typedef struct vsh_atlas_page {
    int32_t width; /* texels */
    int32_t height;
    double texels_per_unit; /* of a mesh of density 1, as given or as found */
    double covered;         /* share of the texels that a chart touches, 0 … 1 */
    uint32_t first_mesh;    /* that has a chart on it */
} vsh_atlas_page;

/* What an atlas comes to. */
typedef struct vsh_atlas_info {
    uint64_t charts;         /* on all pages */
    uint32_t pages;          /* that have charts */
    int32_t width;           /* texels: the most that a page is wide */
    int32_t height;          /* and high */
    double texels_per_unit;  /* as given, or as found; the least of a page */
    double covered;          /* share of the texels of all pages that a chart touches, 0 … 1 */
    double stretch;          /* mean over charts, by area; 1 where there is none */
    double worst_stretch;    /* of a chart */
    uint64_t flat_triangles; /* that have no chart */
    uint64_t kept;           /* meshes whose own UVs were kept */
    uint64_t shared;         /* meshes whose charts are laid out as those of an earlier one */
} vsh_atlas_info;

/* Immutable. Free it with vsh_atlas_free(). It does not need its meshes any more. */
typedef struct vsh_atlas vsh_atlas;

/* Cuts meshes into charts along creases, lays them out with little stretch, and packs them by their shapes.
 * Any triangles will do: edges of many triangles, several at one place, mirrored meshes. Triangles of a quad
 * stay together. Meshes of the same arrays whose transforms differ by a rotation, a mirroring, a translation
 * and a uniform scale share their charts' layout, and have places of their own. A mesh is spread over pages
 * only where it does not fit one. Objects with pages of their own that differ by such transforms alone are
 * packed alike. The values depend on no number of threads. The stages are "unwrap" and
 * "pack". Errors:
 * - VSH_ERROR_ARGUMENT: meshes or atlas NULL, no meshes or more than 2^32 - 1, options out of range, run, and
 *   as vsh_mesh_check();
 * - VSH_ERROR_INPUT: as vsh_mesh_check(); no triangle that has area;
 * - VSH_ERROR_LIMIT: run->memory_limit; charts that do not fit into max_pages at this density (the message
 *   names one that fits, and the object whose page it is), or more charts than there are places in them;
 *   2^32 / 3 triangles of a mesh;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_unwrap(const vsh_mesh *meshes, size_t mesh_count, const vsh_unwrap_options *options,
                              const vsh_run *run, vsh_atlas **atlas, vsh_error *error);
VSH_API void vsh_atlas_free(vsh_atlas *atlas); /* NULL does nothing */

/* 1: the mesh's UVs lie in the unit square, all triangles that have area have area in them too and run the
 * same way, and no two lie over each other (looked at on a grid that is finer than the triangles); 0 else,
 * and where there are none. Errors: VSH_ERROR_ARGUMENT (mesh or usable NULL, run, and as vsh_mesh_check()),
 * VSH_ERROR_INPUT (as vsh_mesh_check()), VSH_ERROR_LIMIT (run->memory_limit), VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_uvs_usable(const vsh_mesh *mesh, const vsh_run *run, int32_t *usable,
                                  vsh_error *error);

/* How a mesh's UVs lie on its surface; both 0 where it has none, or none that have area. */
typedef struct vsh_uvs_measures {
    double texels_per_unit; /* texels along a world unit, as the root of the ratio of areas */
    double stretch; /* L2, of all triangles to their mean density: 1 where all have it and are isometric */
} vsh_uvs_measures;

/* Measures them in a lightmap of this size, texels. Errors: VSH_ERROR_ARGUMENT (mesh or measures NULL, a size
 * out of 1 … VSH_MAX_PAGE_SIZE, and as vsh_mesh_check()), VSH_ERROR_INPUT (as vsh_mesh_check()). */
VSH_API vsh_result vsh_uvs_measure(const vsh_mesh *mesh, int32_t width, int32_t height,
                                   vsh_uvs_measures *measures, vsh_error *error);

/* None of these can fail; `atlas` must not be NULL. */
VSH_API size_t vsh_atlas_mesh_count(const vsh_atlas *atlas); /* as were given */
VSH_API size_t vsh_atlas_chart_count(const vsh_atlas *atlas);
VSH_API size_t vsh_atlas_page_count(const vsh_atlas *atlas);
VSH_API void vsh_atlas_get_info(const vsh_atlas *atlas, vsh_atlas_info *info);

/* A view of mesh `mesh` (< mesh count). */
VSH_API vsh_atlas_mesh vsh_atlas_mesh_view(const vsh_atlas *atlas, size_t mesh);

/* Page `page` (< page count). */
VSH_API vsh_atlas_page vsh_atlas_page_view(const vsh_atlas *atlas, size_t page);

/* All charts, [chart count]; they belong to the atlas. */
VSH_API const vsh_atlas_chart *vsh_atlas_charts(const vsh_atlas *atlas);

#ifdef __cplusplus
}
#endif
#endif
