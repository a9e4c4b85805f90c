/* A lit document under way: what is made of each primitive, mesh, node and material. */
#ifndef VSHI_LIT_WORK_H
#define VSHI_LIT_WORK_H

#include "lit/gather.h"
#include "lit/uv_pool.h"

/* --- materials (materials.c) */

/* What a primitive is to be shown by: a material of the file with the images of a page, in a set of UVs. */
typedef struct vshi_lit_look {
    size_t material; /* SIZE_MAX: none, which is a white one */
    uint32_t page;
    size_t set;
    json_t *transform; /* KHR_texture_transform of the set's UVs; NULL: none */
    size_t made;       /* the material that shows it; SIZE_MAX: not yet, or none */
} vshi_lit_look;

typedef struct vshi_lit_looks {
    vshi_lit_look *list;
    size_t count, capacity;
} vshi_lit_looks;

/* --- primitives (primitive.c) */

/* Vertices of a primitive that an atlas has split, for its other instances. */
typedef struct vshi_lit_split {
    const vsh_lit_mesh *mesh;
    vshi_lit_gathered gathered;
    size_t indices; /* accessor of all triangles; SIZE_MAX: not made */
} vshi_lit_split;

/* A primitive of the file, as all nodes that show it have it. */
typedef struct vshi_lit_shape {
    size_t mesh, primitive;
    vshi_lit_topology topology;
    vshi_lit_split *splits;
    size_t split_count, split_capacity;
} vshi_lit_shape;

/* --- all of it */

typedef struct vshi_lit_work {
    vshi_lit_document document;
    const vsh_model *model;
    const vsh_lit_mesh *meshes; /* [entries of the model] */
    const vsh_lit_options *options;
    const char *output;
    const char *path; /* of the model's file; NULL: none */
    const vsh_run *run;
    vshi_job *job;
    size_t page_count;                  /* 1 + the highest page */
    size_t *textures[VSH_LIT_PURPOSES]; /* [page_count]; SIZE_MAX: none */
    double *intensities;                /* [page_count]: of lightmaps */
    vshi_lit_dracos dracos;
    vshi_lit_uv_pool pool;
    vshi_lit_looks looks;
    vshi_lit_shape *shapes; /* sorted by mesh and primitive, as they came to be needed */
    size_t shape_count, shape_capacity;
} vshi_lit_work;

/* The page of triangle t of a mesh; VSH_LIT_NO_CHART: any. */
static inline uint32_t vshi_lit_page(const vshi_lit_work *work, const vsh_lit_mesh *mesh, size_t t) {
    return mesh->charts == NULL                  ? mesh->page
           : mesh->charts[t] == VSH_LIT_NO_CHART ? VSH_LIT_NO_CHART
                                                 : work->options->chart_pages[mesh->charts[t]];
}

enum { VSHI_LIT_NAME_BYTES = 200 }; /* of a page, in names of files */

/* Checks what the caller gives for the model's mesh `index`. Errors: VSH_ERROR_ARGUMENT. (check.c) */
vsh_result vshi_lit_check_mesh(const vshi_lit_work *work, size_t index, vsh_error *error);
vsh_result vshi_lit_check_images(const vsh_lit_options *options, vsh_error *error);

/* Checks that no primitive names a material that is not there: marks are told from these. Errors:
 * VSH_ERROR_INPUT. */
vsh_result vshi_lit_materials_check(vshi_lit_work *work, vsh_error *error);

/* Marks a primitive and its variants for a page and a set: "material" becomes the look's number, negative
 * until vshi_lit_materials_apply(). `transform` (KHR_texture_transform) maps the set to the page; NULL: none.
 */
vsh_result vshi_lit_mark_primitive(vshi_lit_work *work, json_t *primitive, uint32_t page, size_t set,
                                   json_t *transform, vsh_error *error);

/* Whether holes and glass of a material are in its base colour's texture, so that no preview replaces that.
 */
bool vshi_lit_is_cut_by_texture(const json_t *material);

/* Makes the materials of all looks, and puts them into the primitives of the root's meshes. A material that
 * nothing else uses is changed where it is. Errors: VSH_ERROR_INPUT, VSH_ERROR_MEMORY. */
vsh_result vshi_lit_materials_apply(vshi_lit_work *work, vsh_error *error);

/* Appends to `list` what becomes of primitive `primitive` of mesh `mesh`, which the model's mesh `entry` is:
 * itself, or one for each page. */
vsh_result vshi_lit_primitive_make(vshi_lit_work *work, size_t mesh, size_t primitive, size_t entry,
                                   json_t *list, vsh_error *error);

/* The set of UVs that engines use for lightmaps. */
enum { VSHI_LIT_SET = 1 };

/* Removes the sets of a primitive that new UVs of `mesh` replace, and finds the set that they become. That is
 * the first that is VSHI_LIT_SET or of an earlier bake, if no remaining texture uses it; else one more set.
 * Errors: VSH_ERROR_LIMIT (VSH_MAX_UV_SETS). (own_sets.c) */
vsh_result vshi_lit_choose_set(const vshi_lit_work *work, json_t *primitive, const vsh_lit_mesh *mesh,
                               const char *where, size_t *set, vsh_error *error);

/* Notes in a primitive's extras that a set was made, for the next time. */
vsh_result vshi_lit_tell_set(const vshi_lit_document *document, json_t *primitive, size_t set,
                             vsh_error *error);

/* Appends to `list` a primitive for each page of `mesh`, copies of `made`, whose indices are set: those of
 * triangle t are corners[t]. `whole`: an accessor of all of them, used where there is one page; SIZE_MAX: a
 * new one. Marks them. (pages.c) */
vsh_result vshi_lit_pages_make(vshi_lit_work *work, const json_t *made, const vsh_lit_mesh *mesh,
                               const uint32_t *corners, size_t vertex_count, size_t set, size_t *whole,
                               json_t *list, vsh_error *error);

/* The options' attributes into the extras of the asset. (origin.c) */
vsh_result vshi_lit_tell_origin(vshi_lit_work *work, vsh_error *error);

/* The only page of a mesh, or VSH_LIT_NO_CHART. */
uint32_t vshi_lit_only_page(const vshi_lit_work *work, const vsh_lit_mesh *mesh);

/* Gives nodes the meshes that they show lit. (nodes.c) */
vsh_result vshi_lit_nodes_make(vshi_lit_work *work, vsh_error *error);

/* Fills the document with what the model holds, lit. (from_model.c) */
vsh_result vshi_lit_from_model(vshi_lit_work *work, vsh_error *error);

#endif
