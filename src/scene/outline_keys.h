/* The keys of masks and texts, which solids and flat scenes share. */
#ifndef VSHI_SCENE_OUTLINE_KEYS_H
#define VSHI_SCENE_OUTLINE_KEYS_H

#include "json/keys.h"

#include <vdbshade/outline.h>

/* `size`, one number or two, into a vsh_mask_options. */
vsh_result vshi_read_mask_size(vshi_json *reader, const vshi_value *value, void *mask);

/* Rows for a struct with path, text, mask and letters, which is filled with the options' defaults beforehand;
 * `of_mask` and `of_text` are the bits of the two variants. */
#define VSHI_OUTLINE_KEYS(target, of_mask, of_text)                                                          \
    {.name = "mask", .kind = VSHI_PATH, .variants = of_mask, .offset = offsetof(target, path)},              \
        {.name = "size",                                                                                     \
         .kind = VSHI_CUSTOM,                                                                                \
         .variants = of_mask,                                                                                \
         .required = of_mask,                                                                                \
         .offset = offsetof(target, mask),                                                                   \
         .read = vshi_read_mask_size},                                                                       \
        {.name = "channel",                                                                                  \
         .kind = VSHI_STRING,                                                                                \
         .variants = of_mask,                                                                                \
         .offset = offsetof(target, mask.channel)},                                                          \
        {.name = "threshold",                                                                                \
         .kind = VSHI_NUMBER,                                                                                \
         .variants = of_mask,                                                                                \
         .offset = offsetof(target, mask.threshold),                                                         \
         .lowest = -VSHI_LARGEST,                                                                            \
         .highest = VSHI_LARGEST},                                                                           \
        {.name = "invert", .kind = VSHI_BOOL, .variants = of_mask, .offset = offsetof(target, mask.invert)}, \
        {.name = "text", .kind = VSHI_STRING, .variants = of_text, .offset = offsetof(target, text)},        \
        {.name = "font",                                                                                     \
         .kind = VSHI_PATH,                                                                                  \
         .variants = of_text,                                                                                \
         .required = of_text,                                                                                \
         .offset = offsetof(target, path)},                                                                  \
        {.name = "height",                                                                                   \
         .kind = VSHI_NUMBER,                                                                                \
         .variants = of_text,                                                                                \
         .required = of_text,                                                                                \
         .offset = offsetof(target, letters.height),                                                         \
         .highest = VSHI_LARGEST,                                                                            \
         .flags = VSHI_ABOVE},                                                                               \
        {.name = "line_spacing",                                                                             \
         .kind = VSHI_NUMBER,                                                                                \
         .variants = of_text,                                                                                \
         .offset = offsetof(target, letters.line_spacing),                                                   \
         .highest = 1e3,                                                                                     \
         .flags = VSHI_ABOVE},                                                                               \
    {                                                                                                        \
        .name = "align", .kind = VSHI_NAME, .variants = of_text, .offset = offsetof(target, letters.align),  \
        .names = VSH_NAMES_ALIGN                                                                             \
    }

#endif
