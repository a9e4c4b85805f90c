/* A page that shows a bake in a browser: its text, its data, and a description of them for its script. */
#ifndef VSHI_VIEW_PAGE_H
#define VSHI_VIEW_PAGE_H

#include "base/file.h"
#include "base/job.h"
#include "base/uri.h"

#include <jansson.h>
#include <vdbshade/mesh.h>
#include <vdbshade/view.h>

/* --- the fixed parts: files of src/view/page, and three.js, put into the library by cmake/embed.cmake */

typedef struct vshi_embedded {
    const char *name; /* of the file */
    const unsigned char *bytes;
    size_t size;
} vshi_embedded;

extern const vshi_embedded vshi_view_style;
extern const vshi_embedded vshi_view_body;
extern const vshi_embedded vshi_view_scripts[]; /* in the order in which they run; ended by a size of 0 */

/* --- a page under way: text, and data as base64 */

enum { VSHI_PAGE_BUFFER = 1 << 16 };

typedef struct vshi_page {
    const char *path;
    vshi_output output;
    vshi_sink sink;
    uint64_t written; /* bytes that are in the file */
    size_t used;      /* of `buffer` */
    size_t blocks;    /* data blocks so far */
    char block[32];   /* id of the last one, by which the page's script finds it */
    uint8_t group[VSHI_BASE64_BYTES];
    size_t grouped; /* bytes in `group` */
    char buffer[VSHI_PAGE_BUFFER];
} vshi_page;

/* A failed write shows in vshi_page_check(), and when the page is put in place. */
void vshi_page_put(vshi_page *page, const void *bytes, size_t count);
void vshi_page_text(vshi_page *page, const char *text);
vsh_result vshi_page_check(const vshi_page *page, vsh_error *error);

/* A block of data: begin, any number of pieces, end. */
void vshi_page_data_begin(vshi_page *page);
void vshi_page_data(vshi_page *page, const void *bytes, size_t count);
void vshi_page_data_end(vshi_page *page);

/* --- the parts of a page: models, planes, and their description */

typedef struct vshi_view {
    vshi_page *page;
    const vsh_run *run; /* resolved */
    json_t *about;      /* array: the description of each bake */
} vshi_view;

/* Begins the job of writing one file into the page. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_view_begin(const vshi_view *view, size_t total, vshi_job **job, vsh_error *error);

/* Advances the job by `units`. Errors: VSH_ERROR_CANCELLED, VSH_ERROR_WRITE (an earlier write failed). */
vsh_result vshi_view_advance(const vshi_view *view, vshi_job *job, size_t units, vsh_error *error);

/* Writes a model, after vsh_model_read() has found it sound, and tells of it: "model", "files". */
vsh_result vshi_view_put_model(vshi_view *view, const char *path, json_t *about, vsh_error *error);

/* Writes triangles, normals and UVs of a model as a GLB into a data block, and adds its id to `about`. */
vsh_result vshi_view_put_arrays(vshi_view *view, const char *path, const vsh_model *model, json_t *about,
                                vsh_error *error);

/* Writes the planes of an image, of a file or in memory, and adds what they are to `pages`. */
vsh_result vshi_view_put_planes(vshi_view *view, const char *path, json_t *pages, vsh_error *error);
vsh_result vshi_view_put_image(vshi_view *view, const char *name, const vsh_image *image, json_t *pages,
                               vsh_error *error);

/* A name as JSON, whatever bytes it has; NULL where memory is short. */
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
