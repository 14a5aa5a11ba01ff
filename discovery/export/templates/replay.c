/* Replays the reference inputs of an exported model and compares with the reference outputs of the Python model.
 *
 *   gcc -std=c99 -Wall -Wextra -Werror -O2 replay.c @PREFIX@.c -lm -o replay && ./replay reference_inputs.csv reference_outputs.csv
 *
 * Prints the largest deviation; status 0: within the limit (1e-9 for double, 1e-3 for float), 1: not, 2: files.
 * With a third argument the inputs are replayed that many times more and the time of one step is printed.
 */
#include "@PREFIX@.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#ifdef DISCOVERY_FLOAT
#define LIMIT 1e-3
#else
#define LIMIT 1e-9
#endif

static @PREFIX@_state state;

static int row(FILE *file, double values[], int count)
{
    int i;
    for (i = 0; i < count; ++i) {
        if (fscanf(file, i == 0 ? " %lf" : " , %lf", &values[i]) != 1) { return 0; }
    }
    return 1;
}

static void skip_line(FILE *file)
{
    int c;
    do { c = fgetc(file); } while (c != '\n' && c != EOF);
}

int main(int argc, char **argv)
{
    static double in[@UP@_INPUTS + 1];
    static double expected[@UP@_OUTPUTS + 1];
    static @PREFIX@_real u[@UP@_INPUTS + 1];
    static @PREFIX@_real y[@UP@_OUTPUTS + 1];
    double worst = 0.0;
    long steps = 0;
    int i;
    FILE *inputs = argc > 2 ? fopen(argv[1], "r") : NULL;
    FILE *outputs = argc > 2 ? fopen(argv[2], "r") : NULL;
    if (inputs == NULL || outputs == NULL) {
        fprintf(stderr, "usage: replay reference_inputs.csv reference_outputs.csv [repetitions]\n");
        return 2;
    }
    skip_line(inputs);
    skip_line(outputs);
    while (row(outputs, expected, @UP@_OUTPUTS) && row(inputs, in, @UP@_INPUTS)) {
        for (i = 0; i < @UP@_INPUTS; ++i) { u[i] = (@PREFIX@_real)in[i]; }
        if (steps == 0 && @PREFIX@_start(&state, u) != 0) { fprintf(stderr, "start failed\n"); return 1; }
        if (@PREFIX@_step(&state, u, y) != 0) { fprintf(stderr, "step %ld failed\n", steps); return 1; }
        for (i = 0; i < @UP@_OUTPUTS; ++i) {
            const double deviation = fabs((double)y[i] - expected[i]);
            if (!(deviation <= worst)) { worst = deviation; }
        }
        ++steps;
    }
    printf("%ld steps, largest deviation %.3g\n", steps, worst);
    if (argc > 3) {
        const long repetitions = strtol(argv[3], NULL, 10);
        const clock_t began = clock();
        long k;
        for (k = 0; k < repetitions; ++k) { (void)@PREFIX@_step(&state, u, y); }
        printf("%.4g us per step\n", 1e6 * (double)(clock() - began) / CLOCKS_PER_SEC / (double)repetitions);
    }
    return steps > 0 && worst <= LIMIT ? 0 : 1;
}
