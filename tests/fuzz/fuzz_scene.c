/* Scene files, of both kinds: any bytes are read or refused with a reason. */
#include "fuzz.h"

#include <vdbshade/vdbshade.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const char *path = fuzz_file("a.json", data, size);
    vsh_scene *scene;
    FUZZ_MAKE(scene, vsh_scene_read(path, NULL, &scene, fuzz_error()));
    vsh_scene_free(scene);
    vsh_flat_scene *flat;
    FUZZ_MAKE(flat, vsh_flat_scene_read(path, NULL, &flat, fuzz_error()));
    vsh_flat_scene_free(flat);
    return 0;
}
