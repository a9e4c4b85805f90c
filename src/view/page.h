/* A page under way: text, and data as base64. */
#ifndef VSHI_VIEW_PAGE_H
#define VSHI_VIEW_PAGE_H

#include "base/base64.h"
#include "base/file.h"

enum { VSHI_PAGE_BUFFER = 1 << 16 };

typedef struct vshi_page {
    const char *path;
    vshi_output output;
    vshi_sink sink;
    uint64_t written; /* bytes that are in the file */
    size_t used;      /* of `buffer` */
    uint8_t group[VSHI_BASE64_BYTES];
    size_t grouped; /* bytes in `group` */
    char buffer[VSHI_PAGE_BUFFER];
} vshi_page;

/* Begins the file; end with commit, also where something failed, or with abandon. Errors: as
 * vshi_output_begin(). */
vsh_result vshi_page_begin(vshi_page *page, const char *path, vsh_error *error);
vsh_result vshi_page_commit(vshi_page *page, vsh_error *error);
void vshi_page_abandon(vshi_page *page);

/* A failed write shows in vshi_page_check() and _commit(). */
void vshi_page_put(vshi_page *page, const void *bytes, size_t count);
void vshi_page_text(vshi_page *page, const char *text);
void vshi_page_count(vshi_page *page, uint64_t number);
vsh_result vshi_page_check(const vshi_page *page, vsh_error *error);

/* A block of data that the page finds by its id, KIND and number: begin, any number of pieces, end. */
void vshi_page_data_begin(vshi_page *page, const char *kind, size_t number);
void vshi_page_data(vshi_page *page, const void *bytes, size_t count);
void vshi_page_data_end(vshi_page *page);

#endif
