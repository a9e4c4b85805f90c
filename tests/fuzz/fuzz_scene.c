/* Scene files, of both kinds: any bytes are read or refused with a reason. */
#include "fuzz.h"

#include <vdbshade/vdbshade.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const char *path = fuzz_file("a.json", data, size);
    FUZZ_TRY(vsh_scene, scene, vsh_scene_read(path, NULL, &scene, fuzz_error()));
    FUZZ_TRY(vsh_flat_scene, flat, vsh_flat_scene_read(path, NULL, &flat, fuzz_error()));
    return 0;
}
