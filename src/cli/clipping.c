#include "clipping.h"

#include "message.h"
#include "warnings.h"

int cli_finish_image(vsh_image_writer *writer, const char *output) {
    vsh_error error;
    vsh_image_clipping cut;
    if (vsh_image_writer_get_clipping(writer, &cut, &error) != VSH_OK ||
        vsh_image_writer_finish(writer, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    if (cut.clipped > 0) {
        cli_warn(
            "%s: %.3g %% of the texels are brighter than 1, up to %.3g, and cut to 1: write .exr, or floats "
            "(--bits 32) where the format has them, or dim the lights",
            output, 100.0 * (double)cut.clipped / (double)cut.texels, (double)cut.largest);
    }
    return CLI_OK;
}
