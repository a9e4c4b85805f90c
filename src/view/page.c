#include "view/page.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

vsh_result vshi_page_begin(vshi_page *page, const char *path, vsh_error *error) {
    page->path = path;
    page->written = 0;
    page->used = 0;
    page->grouped = 0;
    page->sink = (vshi_sink){-1, 0};
    const vsh_result result = vshi_output_begin(&page->output, path, error);
    if (result == VSH_OK) {
        page->sink = vshi_sink_open(page->output.temporary);
    }
    return result;
}

static void flush(vshi_page *page) {
    vshi_sink_write(&page->sink, page->buffer, page->used, page->written);
    page->written += page->used;
    page->used = 0;
}

void vshi_page_put(vshi_page *page, const void *bytes, size_t count) {
    const char *from = bytes;
    while (count > 0) {
        const size_t room = sizeof page->buffer - page->used, now = count < room ? count : room;
        memcpy(page->buffer + page->used, from, now);
        page->used += now;
        from += now;
        count -= now;
        if (page->used == sizeof page->buffer) {
            flush(page);
        }
    }
}

void vshi_page_text(vshi_page *page, const char *text) {
    vshi_page_put(page, text, strlen(text));
}

void vshi_page_count(vshi_page *page, uint64_t number) {
    char text[24];
    snprintf(text, sizeof text, "%" PRIu64, number);
    vshi_page_text(page, text);
}

vsh_result vshi_page_check(const vshi_page *page, vsh_error *error) {
    return page->sink.error == 0 ? VSH_OK
                                 : vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s",
                                             page->path, strerror(page->sink.error));
}

vsh_result vshi_page_commit(vshi_page *page, vsh_error *error) {
    flush(page);
    vshi_sink_close(&page->sink);
    const vsh_result result = vshi_page_check(page, error);
    if (result != VSH_OK) {
        vshi_output_abandon(&page->output);
        return result;
    }
    return vshi_output_commit(&page->output, error);
}

void vshi_page_abandon(vshi_page *page) {
    if (page->sink.file >= 0) {
        vshi_sink_close(&page->sink);
    }
    vshi_output_abandon(&page->output);
}

void vshi_page_data_begin(vshi_page *page, const char *kind, size_t number) {
    vshi_page_text(page, "<script type=\"application/octet-stream\" id=\"");
    vshi_page_text(page, kind);
    vshi_page_count(page, number);
    vshi_page_text(page, "\">");
}

static void put_group(vshi_page *page, const uint8_t *bytes, size_t count) {
    char letters[VSHI_BASE64_LETTERS];
    vshi_base64_group(bytes, count, letters);
    vshi_page_put(page, letters, sizeof letters);
}

void vshi_page_data(vshi_page *page, const void *bytes, size_t count) {
    const uint8_t *from = bytes;
    if (page->grouped > 0) {
        while (page->grouped < VSHI_BASE64_BYTES && count > 0) {
            page->group[page->grouped++] = *from++;
            --count;
        }
        if (page->grouped < VSHI_BASE64_BYTES) {
            return;
        }
        put_group(page, page->group, VSHI_BASE64_BYTES);
    }
    for (; count >= VSHI_BASE64_BYTES; count -= VSHI_BASE64_BYTES) {
        put_group(page, from, VSHI_BASE64_BYTES);
        from += VSHI_BASE64_BYTES;
    }
    for (size_t i = 0; i < count; ++i) {
        page->group[i] = from[i];
    }
    page->grouped = count;
}

void vshi_page_data_end(vshi_page *page) {
    if (page->grouped > 0) {
        put_group(page, page->group, page->grouped);
        page->grouped = 0;
    }
    vshi_page_text(page, "</script>\n");
}
