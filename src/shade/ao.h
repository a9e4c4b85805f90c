/* What the methods of ambient occlusion share: a call's task, and the frame of a point. */
#ifndef VSHI_AO_H
#define VSHI_AO_H

#include "shade/links.h"
#include "shade/shade.h"

enum { VSHI_AO_GRAIN = 64 }; /* points a piece, with cones and rays */

enum { VSHI_AO_MAX_CONES = 256, VSHI_AO_NEIGHBOURS = 6, VSHI_AO_TABLE_EDGE = 9 };

typedef struct vshi_ao_cones {
    int32_t count;
    int32_t neighbours;                     /* of each, fewer where there are few cones */
    vshi_vec directions[VSHI_AO_MAX_CONES]; /* around +z, cosine-weighted */
    double sines[VSHI_AO_MAX_CONES];        /* of the cones' half angles */
    uint8_t nearest[VSHI_AO_MAX_CONES][VSHI_AO_NEIGHBOURS];
} vshi_ao_cones;

/* How texels share rays: points of a lattice of texels shoot them where what they see bends so little that
 * the texels between need none; where it bends more, those of a lattice of half the spacing, down to all
 * texels. */
typedef struct vshi_ao_share {
    vshi_texel_map map;      /* of the tile that shoots and what lies around it; numbers are the task's */
    int32_t left, top, side; /* where in the map the tile is, a multiple of the square's side */
    int32_t spacing;         /* texels, the largest: 1, 2, 4 or 8 */
    int32_t *rays;           /* [points]: those that each shot */
    /* [points]: spacing of the lattice that the texel's value is to come from, by a window over it where the
     * texel shot rays, else by those of its cell's corners */
    uint8_t *level;
} vshi_ao_share;

/* Levels of no lattice: not chosen yet; the value is known without rays. */
enum { VSHI_AO_OPEN_LEVEL = 0, VSHI_AO_KNOWN_LEVEL = 0xff };

/* Texels of a square that shoot independently of all others. */
static inline int32_t vshi_ao_square(const vshi_ao_share *share) {
    return 8 * share->spacing;
}

static inline size_t vshi_ao_squares(const vshi_ao_share *share) {
    const size_t across = (size_t)(share->side / vshi_ao_square(share));
    return across * across;
}

/* The corners of a lattice's cell that a texel in it is estimated from, as bits, of those that hang together
 * with it; `whole`: vshi_links_whole()'s. Corner k is k & 1 spacings to the right and k >> 1 down. */
uint32_t vshi_ao_corners(const vshi_texel_map *map, const int32_t cell[2], int32_t spacing, bool whole,
                         int32_t column, int32_t row);

typedef struct vshi_ao_task {
    const vsh_field *field;
    const vsh_triangles *triangles;   /* of exact methods; else may be NULL */
    const struct vshi_layers *layers; /* beside the field; NULL: none */
    const vsh_shade_options *options;
    const vshi_sampler *sampler; /* of rays; else NULL */
    const vshi_ao_cones *cones;  /* of cones */
    double distance;             /* finest voxels */
    double scale;                /* over what lengths AO bends, world units */
    bool sphere;                 /* in free space: all directions alike, no normals, no start offset */
    vshi_vec up;                 /* unit, world space: AO is of what is over its horizon; zero: of all */
    const vshi_kernel *kernel;   /* of a call, as what follows */
    bool outside;                /* the points are known to lie in no solid: samples of a lightmap */
    const vsh_points *points;
    const float *faces; /* [count][3], unit: normals of the faces under the points, whose own normals are
                         * smooth. Directions below the face do not count. NULL: the points' normals */
    float *ao;
    float *deviation;           /* may be NULL */
    const vshi_ao_share *share; /* of texels that share their rays; NULL: each point has its own */
    float *bent; /* [count][3]: the directions that are open, averaged over the whole cosine-weighted
                  * hemisphere (2/3 of the normal where all is open), world space; may be NULL */
} vshi_ao_task;

/* What AO is shaded for. */
typedef struct vshi_ao_shading {
    bool shared;  /* texels share their rays */
    bool bent;    /* bent normals are asked for, too */
    bool outside; /* the points are known to lie in no solid */
    bool sphere;  /* the points are in free space: all directions count alike, and normals are not used */
} vshi_ao_shading;

/* AO, prepared for points that come later. It must not be moved, and what it was made of must outlive it. */
typedef struct vshi_ao_shader {
    vsh_shade_options options; /* settled */
    struct vshi_layers *layers;
    vshi_sampler *sampler;
    vshi_ao_cones cones;
    vshi_ao_task task; /* refers to the four above */
} vshi_ao_shader;

/* Close it also after an error. Errors: as vsh_shade_ao(). */
vsh_result vshi_ao_open(const vsh_occluders *occluders, const vsh_shade_options *options,
                        vshi_ao_shading shading, int32_t isa, vshi_ao_shader *shader, vsh_error *error);
void vshi_ao_close(vshi_ao_shader *shader);

/* Shades points on the calling thread; values depend on the points and their order alone. Any thread.
 * `faces`, `deviation` and `bent`, as of vshi_ao_task, may be NULL. */
void vshi_ao_points(const vshi_ao_shader *shader, const vsh_points *points, const float *faces, float *ao,
                    float *deviation, float *bent, vsh_shade_stats *stats);

/* Shoots the rays of a tile whose texels share them: sets levels and rays of the share's points in the tile,
 * `shot`, the share of each one's own rays that are free, and unless it is NULL `open`, their bent. */
void vshi_ao_shoot(const vshi_ao_shader *shader, const vsh_points *points, const float *faces,
                   const vshi_ao_share *share, float *shot, float *open, vsh_shade_stats *stats);

/* Length of what `bent` is under an open sky: the mean cosine. */
#define VSHI_AO_OPEN (2.0 / 3.0)

/* The mean of `count` directions of which the share `open` is free, with the sum `free`, around a normal.
 * What the directions lean by, with the sum `all`, is taken out: an open sky has the mean of a whole
 * hemisphere. */
static inline vshi_vec vshi_ao_mean(vshi_vec free, vshi_vec all, double open, int32_t count,
                                    vshi_vec normal) {
    const vshi_vec lean = vshi_sub(vshi_scale(normal, VSHI_AO_OPEN), vshi_scale(all, 1.0 / count));
    return vshi_scale(vshi_add(free, vshi_scale(lean, open)), 1.0 / count);
}

/* Whether AO is of what is over a horizon only. */
static inline bool vshi_ao_has_horizon(const vshi_ao_task *task) {
    return vshi_dot(task->up, task->up) > 0.0;
}

static inline void vshi_ao_set_bent(const vshi_ao_task *task, size_t i, vshi_vec d) {
    task->bent[3 * i] = (float)d.x;
    task->bent[3 * i + 1] = (float)d.y;
    task->bent[3 * i + 2] = (float)d.z;
}

/* Checks options (resolved ones); fills *task but for sampler, kernel and arrays, and *cones where the method
 * takes them. `sphere`: AO is the free share of all directions around a point, each counting alike. Errors:
 * VSH_ERROR_ARGUMENT. */
vsh_result vshi_ao_prepare(const vsh_occluders *occluders, const vsh_shade_options *options, bool sphere,
                           vshi_ao_cones *cones, vshi_ao_task *task, vsh_error *error);

/* Points without normals have no AO. Errors: VSH_ERROR_ARGUMENT. */
vsh_result vshi_ao_check_points(const vsh_points *points, vsh_error *error);

/* Whether AO takes the task's sampler. */
static inline bool vshi_ao_has_rays(const vsh_shade_options *options) {
    return (vsh_ao_method_traits(options->ao_method) & VSH_METHOD_RAYS) != 0;
}

/* Whether it is traced against triangles, by options that may not be settled yet (else NULL will do). */
static inline bool vshi_ao_traces(const vsh_shade_options *options, const vsh_triangles *triangles) {
    const int32_t method = vsh_ao_method_resolve(options->ao_method, triangles != NULL);
    return (vsh_ao_method_traits(method) & VSH_METHOD_TRIANGLES) != 0;
}

/* Variance of the share of `rays` rays of a VSH_SAMPLER_… that are free, over p (1 - p). */
double vshi_ao_spread(int32_t sampler, int32_t rays);

/* The same of texels that share their rays: means over windows err by a little more than if texels erred each
 * by itself, where the same edge runs through all of them (test_claims: a slit, 0.88 of its error would be
 * claimed). */
static inline double vshi_ao_shared_spread(int32_t sampler, int32_t rays) {
    return 1.15 * vshi_ao_spread(sampler, rays);
}

/* The most rays that a point takes, by settled options. */
int32_t vshi_ao_most_rays(const vsh_shade_options *options);

/* A vshi_shade_fn of a vshi_ao_task. */
void vshi_ao_shade(const void *task, size_t begin, size_t end, vsh_shade_stats *stats);

/* Where a point's cones and rays begin, and the axes they are given in: the third is the normal. */
typedef struct vshi_ao_frame {
    vshi_vec origin;
    vshi_vec axes[3];
    double grown; /* what is taken off the distances that its cones and rays meet, voxels */
} vshi_ao_frame;

/* The frame of point i in field space; false where the point is invalid: it is then NaN and counted. */
bool vshi_ao_frame_at(const vshi_ao_task *task, size_t i, vshi_ao_frame *frame, vsh_shade_stats *stats);

/* From an average of open directions to a unit bent normal: `normal` (of any length) where nothing is open.
 * NaN stays. */
void vshi_ao_bent(float *bent, const float *normal);

/* vshi_frame() of a unit vector, and the vector. */
void vshi_ao_axes(vshi_vec normal, vshi_vec axes[3]);

/* The face normal of point i, or `normal` where the two are the same but for rounding. */
vshi_vec vshi_ao_face(const vshi_ao_task *task, size_t i, vshi_vec normal);

/* A direction of the frame's axes in their space. */
static inline vshi_vec vshi_ao_direction(const vshi_vec axes[3], vshi_vec d) {
    return vshi_add(vshi_add(vshi_scale(axes[0], d.x), vshi_scale(axes[1], d.y)), vshi_scale(axes[2], d.z));
}

/* The methods: each shades points begin … end - 1, cones and rays VSHI_AO_GRAIN at most. */
vshi_shade_fn vshi_ao_by_cones;
vshi_shade_fn vshi_ao_by_rays;
vshi_shade_fn vshi_ao_by_squares; /* squares of a share, row by row */

/* The sampler of texels that share their rays: blue noise is the same few rays in each, turned, and what
 * those miss no average finds. */
static inline int32_t vshi_ao_tile_sampler(int32_t sampler) {
    return sampler == VSH_SAMPLER_BLUE ? VSH_SAMPLER_SOBOL : sampler;
}

/* The standard error of a texel that ends its tile's rays, of max_error, were it in the middle of its window:
 * what bends in windows adds to it. Values are those of larger windows than a tile has, in whose middle they
 * are, but at the edges of charts. */
#define VSHI_AO_TILE_ENOUGH 0.55

/* Over the hemisphere, or over the whole sphere, each an equal share of its solid angle. */
void vshi_ao_cones_place(vshi_ao_cones *cones, int32_t count, bool sphere);

/* What is known of cone c of a point whose cones have the closenesses `close`: its own over its sine, and the
 * mean of its neighbours' where they are free, both clamped, in [-1, 1] and [0, 1]. */
void vshi_ao_cone_evidence(const vshi_ao_cones *cones, const float *close, int32_t c, double evidence[2]);

/* Where evidence between -1 and 1 falls in the table: its cell's first entry, row by own closeness, and how
 * far in the cell. */
int32_t vshi_ao_table_cell(const double evidence[2], double part[2]);

#endif
