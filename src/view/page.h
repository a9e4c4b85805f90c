/* A page that shows a bake in a browser. */
#pragma once

#include "base/error.h"
#include "base/file.h"
#include "base/job.h"
#include "base/text.h"

#include <vdbshade/picture.h>

/* Files of src/view/page, and three.js, which cmake/embed.cmake writes as arrays. */
typedef struct vshi_embedded {
    const unsigned char *bytes;
    size_t size;
} vshi_embedded;

extern const vshi_embedded vshi_view_style;
extern const vshi_embedded vshi_view_body;
extern const vshi_embedded vshi_view_scripts[]; /* in the order in which they run; the last has size 0 */

/* A surface with values at its vertices: texel i of the image, row by row, is vertex i. */
typedef struct vshi_view_surface {
    const char *name;
    const vsh_model *model; /* of one shape */
    const vsh_image *image;
} vshi_view_surface;

/* Writes a page of the bakes, or of the surface if that is not NULL. Errors: as vsh_view_write(). */
vsh_result vshi_view_write_page(const char *path, const vsh_view_bake *bakes, size_t count,
                                const vshi_view_surface *surface, const vsh_run *run, vsh_error *error);
