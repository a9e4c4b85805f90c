/* A lit document into its files. */
#ifndef VSHI_LIT_WRITE_H
#define VSHI_LIT_WRITE_H

#include "lit/images.h"

/* Writes the document and what stands beside it, all under temporary names first. The document is of no use
 * afterwards. Errors: as vsh_lit_write(). */
vsh_result vshi_lit_write_files(vshi_lit_work *work, const vshi_lit_besides *besides, vsh_error *error);

#endif
