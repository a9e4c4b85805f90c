#include "scene/outline_keys.h"

vsh_result vshi_read_mask_size(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_mask_options *mask = member;
    const vshi_key key = {.kind = json_is_array(value->json) ? VSHI_VECTOR : VSHI_NUMBER,
                          .count = 2,
                          .highest = VSHI_LARGEST,
                          .flags = VSHI_ABOVE};
    double size[2] = {0.0, 0.0}; /* a height of 0: by the image's proportions */
    const vsh_result result = vshi_read_value(reader, value, &key, size);
    mask->width = size[0];
    mask->height = size[1];
    return result;
}
