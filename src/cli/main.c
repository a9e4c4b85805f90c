#include <stdio.h>
#include <vdbshade/vdbshade.h>

int main(void) {
    printf("vdbshade %s\n", vsh_version());
    return 0;
}
