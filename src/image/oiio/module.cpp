#include "base/error.h"
#include "image/oiio_table.h"

// Every symbol but this one is hidden (module.map), so that none is taken for the library's of that name.
const vshi_oiio_table vshi_oiio_module = {
    VSHI_VERSION,  vshi_oiio_format, vshi_oiio_refusal,      vshi_oiio_begin,
    vshi_oiio_add, vshi_oiio_end,    vshi_oiio_writer_bytes, vshi_oiio_read,
};
