/* vsh_reader_serve(): who parses each kind of file. */
#include "image/planes.h"
#include "levelset/access.h"
#include "lit/work.h"
#include "model/model.h"
#include "outline/outline.h"

#include <vdbshade/reader.h>

int32_t vsh_reader_serve(int argc, char **argv) {
    static vshi_serve_fn *const servers[VSHI_READ_KINDS] = {
        [VSHI_READ_GRID] = vshi_serve_grid,     [VSHI_READ_LIST] = vshi_serve_list,
        [VSHI_READ_VOXELS] = vshi_serve_voxels, [VSHI_READ_MODEL] = vshi_serve_model,
        [VSHI_READ_IMAGE] = vshi_serve_image,   [VSHI_READ_TEXT] = vshi_serve_text,
        [VSHI_READ_COPY] = vshi_serve_copy,     [VSHI_READ_DRACO] = vshi_serve_draco,
    };
    return vshi_serve(servers, argc, argv);
}
