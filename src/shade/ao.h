/* Ambient occlusion: one task for all methods, the frame of a point, cones, rays, and texels that share rays.
 */
#pragma once

#include "shade/shade.h"
#include "shade/window.h"

/* --- cones */

enum { VSHI_AO_MAX_CONES = 256, VSHI_AO_NEIGHBOURS = 6, VSHI_AO_TABLE_EDGE = 9 };

typedef struct vshi_ao_cones {
    int32_t count;
    int32_t neighbours;                     /* of each cone; fewer if there are few cones */
    vshi_vec directions[VSHI_AO_MAX_CONES]; /* around +z, cosine-weighted */
    double sines[VSHI_AO_MAX_CONES];        /* of the half angles */
    uint8_t nearest[VSHI_AO_MAX_CONES][VSHI_AO_NEIGHBOURS];
} vshi_ao_cones;

/* Places cones of equal shares over the hemisphere, or over the whole sphere. */
void vshi_ao_cones_place(vshi_ao_cones *cones, int32_t count, bool sphere);

/* The evidence of cone c: its own closeness over its sine, in [-1, 1], and how free its neighbours are on
 * average, in [0, 1]. */
void vshi_ao_cone_evidence(const vshi_ao_cones *cones, const float *close, int32_t c, double evidence[2]);

/* The table's cell for an evidence: the index of its first entry, row by own closeness. `part` is the place
 * in the cell. */
int32_t vshi_ao_table_cell(const double evidence[2], double part[2]);

/* --- texels that share rays */

/* The texels of a coarse lattice shoot. If values bend little there, the texels between need no rays. Else
 * the lattice's spacing is halved, down to all texels. */
typedef struct vshi_ao_share {
    vshi_texel_map map;      /* the tile and the texels around it; its numbers are the task's */
    int32_t left, top, side; /* of the tile in the map; the side is a multiple of the square's */
    int32_t spacing;         /* of the coarsest lattice, texels: 1, 2, 4 or 8 */
    int32_t *rays;           /* [points]: how many each texel shot */
    /* [points]: spacing of the lattice that gives the texel's value. A texel with rays uses a window over
     * that lattice, another texel uses the corners of its cell. */
    uint8_t *level;
} vshi_ao_share;

/* Levels of no lattice: not chosen yet; the value is known without rays. */
enum { VSHI_AO_OPEN_LEVEL = 0, VSHI_AO_KNOWN_LEVEL = 0xff };

/* Finds the corners of a lattice's cell that a texel in it is linked to, as bits. `whole`:
 * vshi_links_whole()'s result. Corner k is k & 1 spacings to the right and k >> 1 down. */
uint32_t vshi_ao_corners(const vshi_texel_map *map, const int32_t cell[2], int32_t spacing, bool whole,
                         int32_t column, int32_t row);

/* The sampler of texels that share rays. Blue noise would turn the same few rays in each texel, and no
 * average finds what they miss. */
static inline int32_t vshi_ao_tile_sampler(int32_t sampler) {
    return sampler == VSH_SAMPLER_BLUE ? VSH_SAMPLER_SOBOL : sampler;
}

/* Standard error, as a share of max_error, at which a texel gets no more rays from its tile. It holds for the
 * middle of a window, and bends in windows add to it. The page's larger windows have most texels in their
 * middle. */
#define VSHI_AO_TILE_ENOUGH 0.55

/* --- the task */

/* Values of AO at points: arrays [points]. */
typedef struct vshi_ao_values {
    float *ao;        /* the free share of the hemisphere */
    float *deviation; /* standard error; may be NULL */
    float *bent; /* [points][3]: mean open direction over the whole cosine-weighted hemisphere, world space
                  * (2/3 of the normal under an open sky); may be NULL */
} vshi_ao_values;

typedef struct vshi_ao_task {
    const vsh_field *field;
    const vshi_triangles *triangles; /* of exact methods; else may be NULL */
    vshi_layers *layers;             /* layers beside the field; NULL: none */
    vsh_shade_options options;       /* settled */
    vshi_sampler *sampler;           /* of methods by rays; else NULL */
    vshi_ao_cones *cones;            /* of the method of cones; else NULL */
    double distance;                 /* finest voxels */
    double scale;                    /* length over which AO bends, world units */
    bool sphere;                     /* in free space: all directions alike, no normals, no start offset */
    vshi_vec up;               /* unit, world space: only directions above its horizon count; zero: all do */
    const vshi_kernel *kernel; /* this and the next members belong to one call */
    int32_t isa;
    bool outside; /* no point lies in a solid: samples of a lightmap */
    const vsh_points *points;
    const float *faces; /* [count][3], unit: normals of the faces under points with smooth normals. Directions
                         * below the face do not count. NULL: the points' normals */
    vshi_ao_values values;
    const vshi_ao_share *share; /* of texels that share their rays; NULL: each point has its own */
} vshi_ao_task;

/* How AO is shaded. */
typedef struct vshi_ao_shading {
    bool shared;  /* texels share their rays */
    bool bent;    /* with bent normals */
    bool outside; /* no point lies in a solid */
    bool sphere;  /* all directions count alike, and points need no normals */
} vshi_ao_shading;

/* Prepares AO for later points. The occluders must outlive the task. Close it even after an error. Errors: as
 * vsh_shade_ao(). */
vsh_result vshi_ao_open(const vsh_occluders *occluders, const vsh_shade_options *options,
                        vshi_ao_shading shading, int32_t isa, vshi_ao_task *task, vsh_error *error);
void vshi_ao_close(vshi_ao_task *task);

/* Settles and checks resolved options. Fills *task except for layers, kernel and arrays. Close the task even
 * after an error. Errors: VSH_ERROR_ARGUMENT, VSH_ERROR_MEMORY. */
vsh_result vshi_ao_prepare(const vsh_occluders *occluders, const vsh_shade_options *options, bool sphere,
                           vshi_ao_task *task, vsh_error *error);

/* Shades points on the calling thread. Values depend only on the points and their order. Thread safe.
 * `faces`, as in vshi_ao_task, may be NULL. */
void vshi_ao_points(const vshi_ao_task *prepared, const vsh_points *points, const float *faces,
                    const vshi_ao_values *values, vsh_shade_stats *stats);

/* Shoots the rays of a tile whose texels share them. Sets levels and rays of the tile's points, and the
 * values of their own rays, without deviations. */
void vshi_ao_shoot(const vshi_ao_task *prepared, const vsh_points *points, const float *faces,
                   const vshi_ao_share *share, const vshi_ao_values *values, vsh_shade_stats *stats);

/* Sets the values of point i. */
static inline void vshi_ao_set(const vshi_ao_values *values, size_t i, float ao, float deviation,
                               vshi_vec bent) {
    values->ao[i] = ao;
    if (values->deviation != NULL) {
        values->deviation[i] = deviation;
    }
    if (values->bent != NULL) {
        vshi_vec_to_floats(bent, values->bent + 3 * i);
    }
}

/* Shades by the options' method, and by the layers: a vshi_shade_fn of a vshi_ao_task. */
vshi_shade_fn vshi_ao_shade;

/* The methods of rays, for at most VSHI_AO_GRAIN points. */
vshi_shade_fn vshi_ao_by_rays;

enum { VSHI_AO_GRAIN = 64 }; /* points of a piece, with cones and rays */

/* Combines the layers with the values of points begin … end - 1 in the task's arrays, at most VSHI_AO_GRAIN
 * points. */
void vshi_layers_ao(const vshi_layers *layers, const vshi_ao_task *task, size_t begin, size_t end,
                    vsh_shade_stats *stats);

static inline bool vshi_ao_has_rays(const vsh_shade_options *options) {
    return (vsh_method_traits(VSH_NAMES_AO, options->ao_method) & VSH_METHOD_RAYS) != 0;
}

/* Whether AO is traced against triangles (NULL: there are none). The options may be unsettled. */
static inline bool vshi_ao_traces(const vsh_shade_options *options, const vshi_triangles *triangles) {
    const int32_t method = vshi_ao_method_resolve(options->ao_method, triangles != NULL);
    return (vsh_method_traits(VSH_NAMES_AO, method) & VSH_METHOD_TRIANGLES) != 0;
}

/* --- the frame of a point */

/* The origin of a point's cones and rays, and their axes. The third axis is the normal. */
typedef struct vshi_ao_frame {
    vshi_vec origin;
    vshi_vec axes[3];
    double grown; /* subtracted from the distances that cones and rays read, voxels */
} vshi_ao_frame;

/* Finds the frame of point i in field space. False for an invalid point: it is counted, and its AO is NaN. */
bool vshi_ao_frame_at(const vshi_ao_task *task, size_t i, vshi_ao_frame *frame, vsh_shade_stats *stats);

/* vshi_frame() of a unit vector, and the vector. */
void vshi_ao_axes(vshi_vec normal, vshi_vec axes[3]);

/* The face normal of point i, or `normal` if the two differ by rounding only. */
vshi_vec vshi_ao_face(const vshi_ao_task *task, size_t i, vshi_vec normal);

/* Turns a direction from the frame's axes to their space. */
static inline vshi_vec vshi_ao_direction(const vshi_vec axes[3], vshi_vec d) {
    return vshi_add(vshi_add(vshi_scale(axes[0], d.x), vshi_scale(axes[1], d.y)), vshi_scale(axes[2], d.z));
}

/* --- bent normals */

/* Length of `bent` under an open sky: the mean cosine. */
#define VSHI_AO_OPEN (2.0 / 3.0)

/* The mean of `count` directions around a normal. The free ones have the share `open` and the sum `free`. The
 * lean of all directions, whose sum is `all`, is removed: an open sky has the mean of a whole hemisphere. */
static inline vshi_vec vshi_ao_mean(vshi_vec free, vshi_vec all, double open, int32_t count,
                                    vshi_vec normal) {
    const vshi_vec lean = vshi_sub(vshi_scale(normal, VSHI_AO_OPEN), vshi_scale(all, 1.0 / count));
    return vshi_scale(vshi_add(free, vshi_scale(lean, open)), 1.0 / count);
}

/* Turns a mean of open directions into a unit bent normal: `normal`, of any length, if no direction is open.
 * NaN stays. */
void vshi_ao_bent(float *bent, const float *normal);

/* --- rays */

/* Variance of the free share of a number of rays, over p (1 - p). */
double vshi_ao_spread(int32_t sampler, int32_t rays);

/* The variance if texels share their rays. The same edge runs through neighbouring texels, so the means over
 * windows err a little more than independent texels would. (Without the factor, the claimed error at a slit
 * in test_claims would be 0.88 of the true one.) */
static inline double vshi_ao_shared_spread(int32_t sampler, int32_t rays) {
    return 1.15 * vshi_ao_spread(sampler, rays);
}

/* The largest number of rays of a point, by settled options. */
int32_t vshi_ao_most_rays(const vsh_shade_options *options);
