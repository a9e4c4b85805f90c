/* Meshes, models, heightfields, procedural SDFs and outlines: the shapes that cast and receive.
 *
 *     static const float positions[] = {-1, 0, -1, 1, 0, -1, 1, 0, 1, -1, 0, 1};
 *     static const uint32_t indices[] = {0, 2, 1, 0, 3, 2};
 *     vsh_mesh ground = {.name = "ground", .positions = positions, .vertex_count = 4,
 *                        .indices = indices, .triangle_count = 2};
 *     vsh_mesh_report report;
 *     vsh_mesh_check(&ground, &report, &error);
 *     vsh_model *model;
 *     vsh_model_read("room.glb", &run, &model, &error);
 *     vsh_mesh room = vsh_model_mesh(model, 0, -1); // a view; free the model last
 */
#pragma once

#include "base.h"

VSH_BEGIN_C

enum { VSH_MAX_UV_SETS = 8, VSH_MAX_STRIDE = 65536 };

/* Whether a mesh encloses a solid. AUTO decides for each connected component. Closed components, and open
 * ones that enclose nearly all of what lies behind their faces, are solid if their faces look outwards. If
 * their faces look inwards, they are rooms cut out of the solids around them, or else thin walls behind the
 * faces. Components that enclose nothing are sheets with air on both sides. */
typedef enum vsh_solidity {
    VSH_SOLIDITY_AUTO,
    VSH_SOLIDITY_SOLID, /* solid, closed over holes, whichever way faces look */
    VSH_SOLIDITY_SHELL, /* all sheets */
    VSH_SOLIDITY_INWARD /* a room or a wall: air inside, whichever way faces look */
} vsh_solidity;

/* How the material of a mesh treats light that passes (glTF's alphaMode). */
typedef enum vsh_alpha_mode {
    VSH_ALPHA_OPAQUE = 0,
    VSH_ALPHA_MASKED = 1, /* its texture cuts holes */
    VSH_ALPHA_BLENDED = 2 /* glass, smoke */
} vsh_alpha_mode;

/* How a texture continues outside 0 … 1. */
typedef enum vsh_wrap {
    VSH_WRAP_REPEAT = 0,
    VSH_WRAP_MIRROR = 1, /* repeated, every other time mirrored */
    VSH_WRAP_CLAMP = 2   /* its edge continues */
} vsh_wrap;

/* A texture that cuts a mesh: light passes where base_alpha × the texture's alpha, sampled bilinearly, is
 * below alpha_cutoff (glTF 2.0, 3.9.4). A view. */
typedef struct vsh_alpha_mask {
    const uint8_t *alpha;   /* [height][width], 255 is 1, row 0 on top (v = 1) */
    int32_t width, height;  /* texels, ≥ 1 */
    vsh_wrap wrap[2];       /* along u and v */
    double uv_transform[6]; /* rows (a, b, c), (d, e, f): sampled at u' = a u + b v + c, v' = d u + e v + f,
                               with v up; finite */
    double alpha_cutoff;    /* ≥ 0 */
    double base_alpha;      /* 0 … 1 */
} vsh_alpha_mask;

/* A triangle mesh. A view: nothing is owned. Zero the members that you do not need. */
typedef struct vsh_mesh {
    const char *name;        /* for messages; may be NULL */
    const float *positions;  /* [vertex_count][3], local units, finite */
    const float *normals;    /* [vertex_count][3], shading normals of any length; NULL: flat */
    const float *uvs;        /* [vertex_count][2], lightmap coordinates, v up; NULL if no bake needs them */
    const uint32_t *indices; /* [triangle_count][3], each < vertex_count, anticlockwise seen from outside */
    size_t vertex_count;     /* at most 2^32 - 1 */
    size_t triangle_count;
    const double *transform; /* [12], local to world, three rows of four (column 3 translates). It may mirror,
                                scale unevenly and shear, but not flatten; NULL: identity */
    const char *object_name; /* of the object that it belongs to; NULL: `name` */
    uint32_t object;         /* meshes with equal numbers are parts of one object; 0: an object of its own */
    vsh_solidity solidity;   /* for casting */
    const struct vsh_checked_mesh *checked; /* set by the library: leave it NULL */
    vsh_alpha_mode alpha;                   /* of its material */
    int32_t one_sided; /* nonzero: light on the backs of its faces passes, as with back-face culling. Methods
                          that march voxels ignore it */
    const vsh_alpha_mask *mask; /* cuts holes into it, so that it casts as a sheet. NULL: no holes */
    const float *mask_uvs; /* [vertex_count][2], texture coordinates for `mask`, v up. Triangles with values
                              that are not finite are opaque */
    const char *material_name; /* may be NULL */
    const uint16_t *indices16; /* instead of `indices`, which must then be NULL */
    /* Bytes from one position to the next, a multiple of 4 up to VSH_MAX_STRIDE; 0: tight. Calls copy arrays
     * with strides, and 16-bit indices, while they run; charts keep their copies. Not for vsh_render(). */
    size_t position_stride;
    size_t normal_stride; /* likewise for normals */
    size_t uv_stride;     /* likewise for UVs */
} vsh_mesh;

/* Findings of vsh_mesh_check(). Vertices at equal positions count as one, so UV seams do not open edges. */
typedef struct vsh_mesh_report {
    size_t degenerate_triangles; /* of zero area; they are skipped everywhere */
    size_t open_edges;           /* edges with an odd number of triangles */
    size_t flipped_edges;        /* edges whose triangles disagree about the outside */
    double area;                 /* of all triangles, world units² */
    double bounds_min[3];        /* world box of the triangles with area; min > max if there are none */
    double bounds_max[3];        /* the other corner */
} vsh_mesh_report;

/* Checks a mesh, except its UVs and normals. Errors (*report is then unchanged):
 * - VSH_ERROR_ARGUMENT: mesh or report NULL; an array NULL whose count is not 0; indices of both sizes; a
 *   stride out of range; more than 2^32 - 1 vertices;
 * - VSH_ERROR_INPUT: a vertex that is not finite, before or after its transform; an index out of range; a
 *   transform that is not finite or flattens;
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_mesh_check(const vsh_mesh *mesh, vsh_mesh_report *report, vsh_error *error);

/* Counts of a mesh's connected components by their solidity. Open surfaces that enclose nearly all of what
 * lies behind their faces count as closed, by the generalized winding number (Jacobson, Kavan,
 * Sorkine-Hornung 2013). */
typedef struct vsh_solidity_report {
    size_t solids; /* faces look outwards */
    size_t rooms;  /* faces look inwards, within solids that they are cut out of */
    size_t walls;  /* faces look inwards, not within solids, or the skin of a hollow house: thin walls with
                      air on both sides */
    size_t sheets; /* air on both sides */
    size_t closed_over;      /* solids and rooms that are closed over holes */
    size_t holes;            /* holes of those */
    size_t open_edges;       /* edges around these holes */
    size_t turned_triangles; /* triangles that face against their neighbours, and are turned over */
    size_t open_solids; /* solids that lack a side: a house without a floor, a cup. Level sets make sheets of
                           them; for rays, points that see only their insides are hidden */
} vsh_solidity_report;

/* Fills reports[mesh_count] for meshes that cast together. Consecutive parts of one object share a report.
 * Errors: as vsh_mesh_check(); VSH_ERROR_LIMIT (run->memory_limit, more than 2^32 / 3 triangles in an
 * object). */
VSH_API vsh_result vsh_mesh_solidity(const vsh_mesh *meshes, size_t mesh_count, const vsh_run *run,
                                     vsh_solidity_report *reports, vsh_error *error);

/* --- models: files of meshes
 *
 * OBJ, glTF and GLB (2.0), PLY, STL, FBX and Collada (.dae). Each use of a mesh by a node or an instance
 * (EXT_mesh_gpu_instancing) is a mesh of its own, with the node's transform. The meshes of a node form one
 * object with the node's name. UVs have v up in every format.
 *
 * - Units: metres if the format knows its unit (glTF, FBX, Collada). OBJ, PLY and STL are unchanged.
 * - Axes: y up if the format knows its axes (glTF, FBX, Collada), else unchanged.
 * - Pose: skins at rest, morph targets at their default weights.
 * - Polygons are triangulated exactly, concave ones too. */

/* Immutable; threads may share it. Free it with vsh_model_free(). */
typedef struct vsh_model vsh_model;

/* Reads a model; the ending of `path` gives its format. It skips meshes that a transform flattens, with a
 * note. It warns about normals that are not finite (flat there) and polygons whose edges cross. Errors:
 * - VSH_ERROR_ARGUMENT: path or model NULL, run;
 * - VSH_ERROR_READ: no such file, no permission, no regular file, empty, cut short, damaged; a glTF's buffer
 *   is missing;
 * - VSH_ERROR_UNSUPPORTED: a glTF of another version, or that requires an unknown extension;
 * - VSH_ERROR_INPUT: no ending or an unknown one (the message names .blend, Alembic and USD); no triangles;
 *   vertices that are not finite; indices out of range; a damaged header or JSON; a file outside the model's
 *   folder (run->allow_outside);
 * - VSH_ERROR_LIMIT: run->memory_limit (about six times the size of the file), nodes nested over 1024 deep;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_model_read(const char *path, const vsh_run *run, vsh_model **model, vsh_error *error);
VSH_API void vsh_model_free(vsh_model *model); /* NULL does nothing */

/* Number of meshes, at least 1; each has a triangle. */
VSH_API size_t vsh_model_mesh_count(const vsh_model *model);

/* Metres in one unit of the file, which positions were multiplied by: 1 for glTF; 0 if the format has no
 * unit. */
VSH_API double vsh_model_unit(const vsh_model *model);

/* Number of UV sets of mesh `index` (< mesh count), 0 … VSH_MAX_UV_SETS. */
VSH_API int32_t vsh_model_uv_sets(const vsh_model *model, size_t index);

/* A view of mesh `index` (< mesh count) with the UVs of set `uv_set` (from 0). -1: the second set, else the
 * first. If the set is missing, `uvs` is NULL. Arrays and names belong to the model. */
VSH_API vsh_mesh vsh_model_mesh(const vsh_model *model, size_t index, int32_t uv_set);

/* --- heightfields */

enum { VSH_MAX_HEIGHTS_SIDE = 65536 };

/* Heights on a regular grid, as a closed solid. A view. In local space y is up. Sample (row, column) is at x
 * = size[0] (column / (columns - 1) - 1/2), z = size[1] (row / (rows - 1) - 1/2), y = height × value: row 0
 * is at -z. The diagonal between the two triangles of a cell runs from its lowest row and column to its
 * highest. Vertical sides reach down to a flat bottom, `base` below the lowest sample. */
typedef struct vsh_heights_source {
    const char *name;        /* for messages, such as a path; may be NULL */
    int32_t columns;         /* along x, 2 … VSH_MAX_HEIGHTS_SIDE */
    int32_t rows;            /* along z, likewise */
    const float *values;     /* [rows][columns], finite */
    double size[2];          /* along x and z, local units, 1e-12 … 1e12 */
    double height;           /* of a value of 1, local units, -1e12 … 1e12; 0 is flat */
    double base;             /* local units, > 0 … 1e12; 0: a twentieth of the longer size */
    const double *transform; /* [12], local to world, as in vsh_mesh; NULL: identity */
} vsh_heights_source;

/* The part of a heightfield that becomes a mesh. */
typedef enum vsh_heights_part {
    VSH_HEIGHTS_SOLID = 0,  /* the closed surface, without UVs: a caster */
    VSH_HEIGHTS_SURFACE = 1 /* the top: a receiver. UVs are 0 … 1, u along x and v against z, so row 0 of a
                               lightmap lies over row 0 of the heights. Normals are central differences */
} vsh_heights_part;

/* Makes a model with one mesh. Free it with vsh_model_free(). Errors:
 * - VSH_ERROR_ARGUMENT: source, values or model NULL, sizes or `part` out of range, run;
 * - VSH_ERROR_INPUT: a value that is not finite, before or after scaling, by its row and column;
 * - VSH_ERROR_LIMIT: more than 2^32 - 1 vertices; run->memory_limit (36 bytes a sample for a solid, 56 for a
 *   surface);
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_model_from_heights(const vsh_heights_source *source, vsh_heights_part part,
                                          const vsh_run *run, vsh_model **model, vsh_error *error);

/* --- procedural signed distance fields
 *
 * A tree of shapes as an array of nodes. Shapes stand at the origin and operations combine earlier nodes.
 * Then the node's scale, rotation and translation apply, in that order. Sources: I. Quilez, "distance
 * functions" (2008 …), "exact SDF of a capped cone" (2018), "smooth minimum" (2013). */

/* Shapes and operations, and the members that they take. */
typedef enum vsh_sdf_shape {
    VSH_SDF_SPHERE = 0,       /* radius */
    VSH_SDF_BOX = 1,          /* size: half edges; grown by rounding on every side */
    VSH_SDF_TORUS = 2,        /* around y: radius of the ring, minor_radius of the tube */
    VSH_SDF_PLANE = 3,        /* slab with half edges size[0], size[2], size[1] thick, top at y = 0 */
    VSH_SDF_CAPSULE = 4,      /* along y: half height size[1] of the core, radius */
    VSH_SDF_CYLINDER = 5,     /* along y: half height size[1], radius */
    VSH_SDF_CONE = 6,         /* along y: half height size[1], radius at -y, minor_radius at +y (0: a tip) */
    VSH_SDF_UNION = 7,        /* left, right */
    VSH_SDF_INTERSECTION = 8, /* left, right */
    VSH_SDF_SUBTRACTION = 9,  /* left without right */
    VSH_SDF_SMOOTH_UNION = 10 /* left, right, blended over a distance of `smoothing` */
} vsh_sdf_shape;

/* A node. Numbers are finite, lengths in world units before `scale`. Members that a shape does not name are
 * ignored. */
typedef struct vsh_sdf_node {
    vsh_sdf_shape shape;   /* or operation */
    int32_t left;          /* operations: index of the first operand, below this node's own */
    int32_t right;         /* operations: index of the second operand, below this node's own */
    double size[3];        /* > 0 */
    double radius;         /* > 0 */
    double minor_radius;   /* > 0; cone: ≥ 0 */
    double rounding;       /* ≥ 0 */
    double smoothing;      /* > 0 */
    double scale;          /* > 0 */
    double rotation[4];    /* quaternion x, y, z, w; any length but 0 */
    double translation[3]; /* in the space of the operation that uses the node */
} vsh_sdf_node;

/* A unit sphere at the origin. */
static inline vsh_sdf_node vsh_sdf_node_default(void) {
    vsh_sdf_node node = {
        VSH_SDF_SPHERE, -1, -1, {1.0, 1.0, 1.0}, 1.0, 0.25, 0.0, 0.1, 1.0, {0.0, 0.0, 0.0, 1.0},
        {0.0, 0.0, 0.0}};
    return node;
}

/* A tree. A view. The last node is the root; every other node is the operand of exactly one operation. No
 * path from the root is longer than 2048 nodes. */
typedef struct vsh_sdf {
    const vsh_sdf_node *nodes; /* [node_count] */
    size_t node_count;         /* 1 … 65536 */
} vsh_sdf;

/* --- outlines: areas of a plane, for extruded casters and flat scenes */

/* An area of the xy-plane, x to the right, y up, world units. Immutable; threads may share it. */
typedef struct vsh_outline vsh_outline;

/* How an image becomes an outline. */
typedef struct vsh_mask_options {
    size_t struct_size;
    double width;        /* of the image, world units, > 0 … 1e15 */
    double height;       /* likewise; 0: by the image's proportions, with square pixels */
    double threshold;    /* values from here on are solid; finite. 0.5: half of an integer format's range */
    const char *channel; /* "alpha", "luminance" (Rec. 709), "red", "green", "blue", or a channel's name;
                            NULL: alpha if it is below 1 anywhere, else luminance */
    int32_t invert;      /* nonzero: values below the threshold are solid */
} vsh_mask_options;

static inline vsh_mask_options vsh_mask_options_default(void) {
    vsh_mask_options options = {sizeof(vsh_mask_options), 1.0, 0.0, 0.5, NULL, 0};
    return options;
}

/* How lines of text are aligned. */
typedef enum vsh_align { VSH_ALIGN_LEFT = 0, VSH_ALIGN_CENTER = 1, VSH_ALIGN_RIGHT = 2 } vsh_align;

/* How text becomes an outline. */
typedef struct vsh_text_options {
    size_t struct_size;
    double height;       /* of the font's em, world units, > 0 … 1e15; capitals are about 0.7 of it */
    double line_spacing; /* between baselines, as a multiple of the font's own, > 0 … 1e3 */
    vsh_align align;     /* where lines lie relative to x = 0 */
} vsh_text_options;

static inline vsh_text_options vsh_text_options_default(void) {
    vsh_text_options options = {sizeof(vsh_text_options), 1.0, 1.0, VSH_ALIGN_LEFT};
    return options;
}

/* Makes the area that closed polygons wind around, by the nonzero rule: a polygon inside another that runs
 * the other way is a hole. `points` [sum of counts][2], world units, at most 1e15 in size; `counts`
 * [contour_count]. Contours may cross each other and themselves. Errors: VSH_ERROR_ARGUMENT (an array or
 * outline NULL, run), VSH_ERROR_INPUT (a point out of range, no area), VSH_ERROR_LIMIT (run->memory_limit,
 * more than 2^31 points), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_outline_from_polygons(const double *points, const size_t *counts, size_t contour_count,
                                             const vsh_run *run, vsh_outline **outline, vsh_error *error);
VSH_API void vsh_outline_free(vsh_outline *outline); /* NULL does nothing */

VSH_END_C
