#include "sandbox/request.h"

#include "sandbox/reader.h"

#include <vdbshade/reader.h>

#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>

bool vshi_request_read(vshi_request *request) {
    struct stat status;
    if (fstat(VSHI_READER_REQUEST, &status) != 0 || status.st_size <= 0) {
        return false;
    }
    const void *map = mmap(NULL, (size_t)status.st_size, PROT_READ, MAP_PRIVATE, VSHI_READER_REQUEST, 0);
    if (map == MAP_FAILED) {
        return false;
    }
    vshi_decoder decoder = {map, (const unsigned char *)map + status.st_size, false};
    if (vshi_decode_count(&decoder, UINT64_MAX) != VSHI_REQUEST_MAGIC ||
        vshi_decode_count(&decoder, UINT64_MAX) != VSHI_READER_PROTOCOL) {
        return false;
    }
    *request = (vshi_request){.kind = vshi_decode_count(&decoder, VSHI_READ_KINDS - 1)};
    request->parent = vshi_decode_count(&decoder, INT32_MAX);
    request->memory = vshi_decode_count(&decoder, UINT64_MAX);
    request->seconds = vshi_decode_number(&decoder);
    request->demanded = vshi_decode_count(&decoder, 1) != 0;
    request->outside = vshi_decode_count(&decoder, 1) != 0;
    request->path = vshi_decode_text(&decoder, false);
    request->folder_count = (size_t)vshi_decode_count(&decoder, VSHI_MOST_FOLDERS);
    for (size_t i = 0; i < request->folder_count; ++i) {
        request->folders[i] = vshi_decode_text(&decoder, false);
        decoder.bad = decoder.bad || request->folders[i] == NULL;
    }
    request->rest = decoder;
    return !decoder.bad && request->path != NULL;
}

const char *vshi_missing_text(uint64_t confined, char text[VSHI_MISSING_TEXT]) {
    static const struct {
        uint32_t bit;
        const char *name;
    } parts[] = {{VSH_CONFINED_LIMITS, "limits of resources"},
                 {VSH_CONFINED_CALLS, "seccomp (system calls)"},
                 {VSH_CONFINED_FILES, "Landlock (files)"}};
    text[0] = '\0';
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; ++i) {
        if ((confined & parts[i].bit) == 0) {
            const size_t used = strlen(text);
            snprintf(text + used, VSHI_MISSING_TEXT - used, "%s%s", used > 0 ? ", " : "", parts[i].name);
        }
    }
    return text;
}
