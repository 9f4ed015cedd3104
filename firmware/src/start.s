// Runs right after the first stage (first_stage.s), or instead of it where a debug probe starts the
// program, before any memory is initialized, and so uses registers only. Waits until the core's
// supply is valid: no memory may be written before (RM0433, 6.4.1). Switches on the clocks of SRAM1
// to SRAM3. Loads .itcm and .sram (memory.x) from flash in double words, the unit of error
// correction, and clears .sram_zero and .axisram_cached.

    .syntax unified
    .section .text.__pre_init, "ax", %progbits
    .global __pre_init
    .type __pre_init, %function
    .thumb_func
__pre_init:
    ldr     r0, =0x5802480C         // PWR_CR3: the supply is the internal regulator. Written once
    ldr     r1, [r0]                // after power-on; the HAL's later write does nothing
    orr     r1, #0x00000002         // LDOEN
    str     r1, [r0]
    ldr     r0, =0x58024804         // PWR_CSR1
8:  ldr     r1, [r0]
    tst     r1, #0x00002000         // ACTVOSRDY
    beq     8b

    ldr     r0, =0x580244DC         // RCC_AHB2ENR
    ldr     r1, [r0]
    orr     r1, r1, #0xE0000000     // SRAM3EN, SRAM2EN, SRAM1EN
    str     r1, [r0]
    ldr     r1, [r0]                // the clocks run after this (RM0433, section 8.5.10)
    dsb

    ldr     r0, =__sitcm
    ldr     r1, =__eitcm
    ldr     r2, =__itcm_load
1:  cmp     r0, r1
    bhs     2f
    ldrd    r3, r12, [r2], #8
    strd    r3, r12, [r0], #8
    b       1b

2:  ldr     r0, =__ssram
    ldr     r1, =__esram
    ldr     r2, =__sram_load
3:  cmp     r0, r1
    bhs     4f
    ldrd    r3, r12, [r2], #8
    strd    r3, r12, [r0], #8
    b       3b

4:  ldr     r0, =__ssram_zero
    ldr     r1, =__esram_zero
    movs    r3, #0
    mov     r12, r3
5:  cmp     r0, r1
    bhs     6f
    strd    r3, r12, [r0], #8
    b       5b

6:  ldr     r0, =__saxisram_cached
    ldr     r1, =__eaxisram_cached
8:  cmp     r0, r1
    bhs     9f
    strd    r3, r12, [r0], #8
    b       8b

9:  dsb
    isb
    bx      lr
    .ltorg
    .size __pre_init, . - __pre_init
