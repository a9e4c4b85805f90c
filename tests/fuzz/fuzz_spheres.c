/* Files of spheres, and what is made of them. */
#include "fuzz.h"

#include <vdbshade/spheres.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const char *path = fuzz_file("a.csv", data, size);
    const vsh_run run = fuzz_run();
    double *list;
    size_t count;
    const vsh_result result = vsh_spheres_read(path, &run, &list, &count, fuzz_error());
    fuzz_ended(result, list);
    if (result == VSH_OK) {
        vsh_spheres *spheres;
        FUZZ_MAKE(spheres, vsh_spheres_create(list, count, NULL, &run, &spheres, fuzz_error()));
        vsh_spheres_free(spheres);
    }
    vsh_spheres_list_free(list);
    return 0;
}
