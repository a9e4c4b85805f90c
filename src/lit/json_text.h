/* JSON as text: members in the order that they were read in, numbers as short as they can be read back. */
#ifndef VSHI_LIT_JSON_TEXT_H
#define VSHI_LIT_JSON_TEXT_H

#include "lit/document.h"

/* The text of a value into `text`, which is empty; of a document's file one with lines and indents (`lines`).
 * Errors: VSH_ERROR_MEMORY. Free text->at with free(), after a failure too. */
vsh_result vshi_lit_json_text(const json_t *value, bool lines, const char *what, vshi_lit_bytes *text,
                              vsh_error *error);

#endif
