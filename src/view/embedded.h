/* What every page consists of: files of src/view/page, and three.js, put into the library by
 * cmake/embed.cmake. */
#ifndef VSHI_VIEW_EMBEDDED_H
#define VSHI_VIEW_EMBEDDED_H

#include <stddef.h>

typedef struct vshi_embedded {
    const char *name; /* of the file */
    const unsigned char *bytes;
    size_t size;
} vshi_embedded;

extern const vshi_embedded vshi_view_style;
extern const vshi_embedded vshi_view_body;
extern const vshi_embedded vshi_view_scripts[]; /* in the order in which they run; ended by a size of 0 */

#endif
