/* The parts of a page: models, planes, and what its script is told about them. */
#ifndef VSHI_VIEW_PARTS_H
#define VSHI_VIEW_PARTS_H

#include "base/job.h"
#include "view/page.h"

#include <jansson.h>
#include <vdbshade/mesh.h>
#include <vdbshade/view.h>

/* A page as it is written, and the numbers of its data blocks. */
typedef struct vshi_view {
    vshi_page *page;
    const vsh_run *run; /* resolved */
    size_t blocks;      /* data blocks so far, whose ids are VSHI_VIEW_BLOCK and their number */
    json_t *about;      /* array of what is known of each bake; borrowed by nobody */
} vshi_view;

#define VSHI_VIEW_BLOCK "data"

/* Begins the job of what is put into the page of one file, once that is read. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_view_begin(const vshi_view *view, size_t total, vshi_job **job, vsh_error *error);

/* Says that `units` more are done. Errors: VSH_ERROR_CANCELLED, VSH_ERROR_WRITE of what was put so far. */
vsh_result vshi_view_advance(const vshi_view *view, vshi_job *job, size_t units, vsh_error *error);

/* Writes a model, after vsh_model_read() has found it sound, and tells of it: "model", "files". */
vsh_result vshi_view_put_model(vshi_view *view, const char *path, json_t *about, vsh_error *error);

/* The triangles, normals and UVs of a model as a GLB in a data block. */
vsh_result vshi_view_put_arrays(vshi_view *view, const char *path, const vsh_model *model, vsh_error *error);

/* Writes the planes of an image, of a file or in memory, and adds what they are to `pages`. */
vsh_result vshi_view_put_planes(vshi_view *view, const char *path, json_t *pages, vsh_error *error);
vsh_result vshi_view_put_image(vshi_view *view, const char *name, const vsh_image *image, json_t *pages,
                               vsh_error *error);

/* Whatever a name holds, as JSON; NULL where memory is short. */
json_t *vshi_view_text(const char *text);

/* JSON as text; the caller frees it. NULL if memory is short: json_dumps() would leave out keys. */
char *vshi_view_dump(const json_t *json);

/* A surface, and an image whose texel i, row by row, has the values of vertex i. */
typedef struct vshi_view_surface {
    const char *name;
    const vsh_model *model; /* of one shape */
    const vsh_image *image; /* NULL: no values */
} vshi_view_surface;

/* Writes a page of the bakes, or of the surface where that is not NULL. Errors: as vsh_view_write(). */
vsh_result vshi_view_write_page(const char *path, const vsh_view_bake *bakes, size_t count,
                                const vshi_view_surface *surface, const vsh_run *run, vsh_error *error);

/* A path's last part. */
const char *vshi_view_file_name(const char *path);

/* Adds `value` (NULL: memory was short) to an object or, with key NULL, to an array, and takes it over. */
vsh_result vshi_view_tell(json_t *about, const char *key, json_t *value, vsh_error *error);

#endif
