/* Triangle meshes: views of the caller's arrays, a check of them, and models read from files. */
#ifndef VDBSHADE_MESH_H
#define VDBSHADE_MESH_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VSH_MAX_UV_SETS = 8 };

/* What a mesh is taken for. AUTO looks at each piece of it that hangs together by its edges: closed ones, and
 * open ones that enclose nearly all of what is behind their faces, are solid where their faces look outwards;
 * where they look inwards they are rooms, cut out of the solids around them, or else thin walls behind the
 * faces; what encloses nothing is a sheet with air on both sides. */
enum {
    VSH_SOLIDITY_AUTO,
    VSH_SOLIDITY_SOLID, /* what it encloses is solid whatever way its faces look, and closed over its holes */
    VSH_SOLIDITY_SHELL, /* all sheets */
    VSH_SOLIDITY_INWARD /* air in what it encloses, whatever way its faces look: a room or a wall */
};

/* What a mesh's material makes of light that comes through (glTF's alphaMode). */
enum {
    VSH_ALPHA_OPAQUE = 0,
    VSH_ALPHA_MASKED = 1, /* holes where its texture says so */
    VSH_ALPHA_BLENDED = 2 /* glass, smoke */
};

/* What a texture is where UVs leave 0 … 1. */
enum {
    VSH_WRAP_REPEAT = 0,
    VSH_WRAP_MIRROR = 1, /* repeated, every other time mirrored */
    VSH_WRAP_CLAMP = 2   /* its edge goes on */
};

/* Which channel of an image a material's alpha is. */
enum {
    VSH_MASK_CHANNEL_ALPHA = 0, /* A; 1 where there is none */
    VSH_MASK_CHANNEL_RED = 1,
    VSH_MASK_CHANNEL_GREEN = 2,
    VSH_MASK_CHANNEL_BLUE = 3,
    VSH_MASK_CHANNEL_LUMINANCE = 4, /* 0.2126 R + 0.7152 G + 0.0722 B as they are in the file, or Y */
    VSH_MASK_CHANNEL_AUTO = 5       /* A where it is below 1 anywhere, else the luminance */
};

/* Where a mesh is cut out by a texture: light comes through where base_alpha × the texture's alpha, looked up
 * bilinearly, is below alpha_cutoff (glTF 2.0, 3.9.4). A view; nothing is owned. */
typedef struct vsh_alpha_mask {
    const uint8_t *alpha;   /* [height][width], 255 is 1, row 0 on top (v = 1) */
    int32_t width, height;  /* texels, ≥ 1 */
    int32_t wrap[2];        /* VSH_WRAP_…, along u and v */
    double uv_transform[6]; /* rows (a, b, c), (d, e, f): looked up at u' = a u + b v + c, v' = d u + e v + f,
                               v up in all; all finite */
    double alpha_cutoff;    /* ≥ 0 */
    double base_alpha;      /* 0 … 1 */
} vsh_alpha_mask;

/* A view of a triangle mesh: nothing is copied or owned. */
typedef struct vsh_mesh {
    const char *name;       /* for messages; may be NULL */
    const float *positions; /* [vertex_count][3], local units, finite */
    const float *normals;   /* [vertex_count][3], shading normals of any length, or NULL: flat */
    const float *uvs;       /* [vertex_count][2], lightmap coordinates, v up; NULL where no bake needs them */
    const uint32_t *indices; /* [triangle_count][3], each < vertex_count, anticlockwise from outside */
    size_t vertex_count;     /* at most 2^32 - 1 */
    size_t triangle_count;
    const double *transform; /* [12], local to world, three rows of four (column 3 translates), may mirror,
                                scale unevenly and shear, but not flatten; NULL: identity */
    const char *object_name; /* of the object that it is a part of; may be NULL: `name` */
    uint32_t object;  /* meshes of one number are parts of one object (a part for each of its materials);
                         0: an object of its own */
    int32_t solidity; /* VSH_SOLIDITY_…; where it casts */
    const struct vsh_checked_mesh *checked; /* what is known of views from a scene's assets, so that it is
                                               not looked for again. Else NULL */
    int32_t alpha;     /* VSH_ALPHA_…; what scenes make of it: vsh_caster.cast_blended */
    int32_t one_sided; /* nonzero: where it casts, light that falls on the backs of its faces comes through,
                          as where an engine culls back faces; methods that march voxels take no notice */
    const vsh_alpha_mask *mask; /* where it is cut out; it casts so, and is a sheet whatever its solidity
                                   says. NULL: nowhere */
    const float *mask_uvs;      /* [vertex_count][2], texture coordinates for the mask, v up; where there is a
                                   mask. What is not finite is opaque */
    const char *material_name;  /* may be NULL */
} vsh_mesh;

/* Whether a mesh is meant by `pattern`: "material:PATTERN" means those whose material's name PATTERN is, or
 * matches; any other its name, its object's name, or what its name has behind its object's
 * ("Wall", "Cube.003" and "Wall/Cube.003" for a node Wall with a mesh Cube.003) is `pattern`, or is matched
 * by it as a shell matches: * for anything, ? for one character, [a-c] for one byte of some, [!a-c] for one
 * of all others, \\ before what is meant as it is. Case counts. A mesh without names is called "". 1 or 0; 0
 * too where either is NULL. */
VSH_API int32_t vsh_mesh_matches(const vsh_mesh *mesh, const char *pattern);

/* What vsh_mesh_check() found. Vertices at equal positions count as one, so seams of UVs open nothing. */
typedef struct vsh_mesh_report {
    size_t degenerate_triangles; /* of zero area; they are skipped everywhere */
    size_t open_edges;           /* edges with an odd number of triangles */
    size_t flipped_edges;        /* edges whose triangles disagree about the outside */
    double area;                 /* world units², of all triangles */
    double bounds_min[3]; /* world units, over triangles of some area; min > max where there are none */
    double bounds_max[3];
} vsh_mesh_report;

/* Looks a mesh over; UVs and normals are not looked at. Errors (*report is then left alone):
 * - VSH_ERROR_ARGUMENT: mesh or report NULL, an array NULL whose count is not 0, more than 2^32 - 1
 *   vertices;
 * - VSH_ERROR_INPUT: a vertex that is not finite (or not once transformed), an index out of range, a
 *   transform that is not finite or flattens;
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_mesh_check(const vsh_mesh *mesh, vsh_mesh_report *report, vsh_error *error);

/* A file of meshes: OBJ, glTF or GLB (2.0), PLY, STL, FBX or Collada (.dae). A node's transform is that
 * of its mesh's view; a mesh that two nodes use is two meshes, and so are the instances of
 * EXT_mesh_gpu_instancing. The meshes of a node are one object, and its name that of the node. UVs have v up
 * in every format.
 *
 * - Units: positions are in metres where the format knows its unit (glTF: metres; FBX, Collada: as the
 *   file says); OBJ, PLY and STL are numbers as they are.
 * - Axes: as glTF has them, y up, in formats that know theirs (FBX, Collada); else as they are.
 * - Pose: skins at rest, that is as the nodes stand in the file; morph targets at their default weights.
 * - Polygons are cut into triangles that cover them exactly, concave ones too. */
typedef struct vsh_model vsh_model;

/* Reads a model; the ending of `path` tells its format. Notes meshes that a transform flattens (left
 * out), and warns of normals that are not finite (flat there) and of polygons whose edges cross. Free the
 * result with vsh_model_free(). Errors:
 * - VSH_ERROR_ARGUMENT: path or model NULL, run;
 * - VSH_ERROR_READ: no such file, no permission, no regular file, empty, cut short, damaged, or a glTF's
 *   buffer that is not beside it;
 * - VSH_ERROR_UNSUPPORTED: a glTF that needs an extension that is not read, or of another version;
 * - VSH_ERROR_INPUT: no ending, or one of no format that is read (.blend, Alembic and USD files, by their
 *   first bytes too); no triangles; vertices that are not finite, indices out of range, a damaged header or
 *   JSON; a file that it names outside of its folder (run->allow_outside);
 * - VSH_ERROR_LIMIT: run->memory_limit (about six bytes for one of the file), nodes nested more than 1024
 *   deep;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_model_read(const char *path, const vsh_run *run, vsh_model **model, vsh_error *error);
VSH_API void vsh_model_free(vsh_model *model); /* NULL does nothing */

/* Number of meshes, at least 1; each has a triangle. */
VSH_API size_t vsh_model_mesh_count(const vsh_model *model);

/* Metres in one unit of the file, by which positions have been multiplied: 1 for glTF; 0 where the
 * format has no unit. */
VSH_API double vsh_model_unit(const vsh_model *model);

/* Metres in a unit: "m", "cm", "mm", "in" or "ft"; 0 for what is none, and NULL. */
VSH_API double vsh_unit(const char *name);

/* Number of UV sets of mesh `index` (< mesh count), 0 … VSH_MAX_UV_SETS. */
VSH_API int32_t vsh_model_uv_sets(const vsh_model *model, size_t index);

/* A material of a file, as far as it decides where light comes through. What is of the texture is told
 * of masked and blended ones; light comes through masked ones where base_alpha × the texture's alpha <
 * alpha_cutoff. */
typedef struct vsh_model_material {
    const char *name;       /* NULL where it has none */
    int32_t alpha;          /* VSH_ALPHA_… */
    int32_t double_sided;   /* 1: both sides of its faces are seen */
    double alpha_cutoff;    /* ≥ 0; 0 where it is not masked */
    double base_alpha;      /* 0 … 1 */
    int32_t uv_set;         /* of the texture, 0 … VSH_MAX_UV_SETS - 1; a mesh need not have it */
    int32_t wrap[2];        /* VSH_WRAP_…, along u and v */
    double uv_transform[6]; /* rows (a, b, c), (d, e, f): the image is looked up at u' = a u + b v + c,
                               v' = d u + e v + f, v up in all */
    const void *image; /* the base colour's image file (PNG, JPEG, …) as it is in the model; NULL where it
                          is a file of its own, or none */
    size_t image_size; /* bytes of it */
    const char *image_path; /* the file, within the model's folder unless run->allow_outside; it need not be
                               there. NULL: none */
    int32_t image_channel;  /* VSH_MASK_CHANNEL_… */
    int32_t by_texture; /* 1: the format has no mode of alpha (OBJ): it is blended by base_alpha and the image
                           alone, and as good as opaque where neither leaves anything out */
} vsh_model_material;

/* Number of materials of the file: of PLY 0. Of formats other than glTF and OBJ name and
 * `alpha` are told. */
VSH_API size_t vsh_model_material_count(const vsh_model *model);

/* Material `index` (< material count). What it points to belongs to the model. */
VSH_API vsh_model_material vsh_model_get_material(const vsh_model *model, size_t index);

/* The material of mesh `index` (< mesh count); -1: none. */
VSH_API int32_t vsh_model_mesh_material(const vsh_model *model, size_t index);

/* How a light of a file shines. */
enum {
    VSH_MODEL_LIGHT_DIRECTIONAL = 0, /* from far away: direction */
    VSH_MODEL_LIGHT_POINT = 1,       /* position, range */
    VSH_MODEL_LIGHT_SPOT = 2         /* position, direction, range, angles */
};

/* A light that a file's node carries (glTF: KHR_lights_punctual). Lights of files have no size: shadows take
 * an angle or a radius of the caller's. */
typedef struct vsh_model_light {
    const char *name;    /* the node's, else the light's; NULL where neither has one */
    int32_t type;        /* VSH_MODEL_LIGHT_… */
    double position[3];  /* world, metres */
    double direction[3]; /* world, of length 1: the way it shines, away from it; of a point 0, 0, 0 */
    double color[3];     /* linear RGB, ≥ 0, without the intensity */
    double intensity;    /* ≥ 0: lux, of a directional one at normal incidence; else candela */
    double range;        /* metres, where it is said to end; 0: nowhere */
    double inner_angle;  /* spot: half angle of full light, radians, 0 … outer_angle; else 0 */
    double outer_angle;  /* spot: half angle where light ends, radians, > 0 … π / 2; else 0 */
} vsh_model_light;

/* Number of lights of the file's scene: of glTF; of other formats 0. */
VSH_API size_t vsh_model_light_count(const vsh_model *model);

/* Light `index` (< light count), in the order in which its nodes are met. Its name belongs to the model. */
VSH_API vsh_model_light vsh_model_get_light(const vsh_model *model, size_t index);

/* A view of mesh `index` (< mesh count), with the UVs of set `uv_set` (from 0); -1 takes the second set where
 * there is one, else the first. Where the set is missing, `uvs` is NULL. The view's arrays and name belong to
 * the model. */
VSH_API vsh_mesh vsh_model_mesh(const vsh_model *model, size_t index, int32_t uv_set);

#ifdef __cplusplus
}
#endif
#endif
