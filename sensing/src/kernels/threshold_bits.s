@ The mask of RGB565 pixels through a table of bits: see `threshold_bits` in cortex_m7.rs.
@
@ r0 pixels   r1 table   r2 where the mask goes   r3 its end   r4, r6, r8, r10 pixels   r5, r7, r9, r11 their words of the table
@ r12 the word of the mask   stack: the first pixel
@
@ Each step takes the bit of one pixel, looks up the word of the next, and loads the one after that; behind the last word
@ of the mask these are the row's first pixels again, so that nothing beyond it is read.

    .syntax unified
    .section .itcm.hivtac_threshold_bits, "ax", %progbits
    .balign 8
    .global hivtac_threshold_bits
    .type hivtac_threshold_bits, %function
    .thumb_func

@ Bit \i of pixel \p0 with word \w0; \p1 and \w1 are the next, and \p2, at offset \x, the one after it.
.macro hivtac_threshold_bits_pixel i, x, p0, w0, p1, w1, p2
    lsr.w  \w1, \p1, #5
    ldrh.w \p2, [r0, #\x]
    ror.w  \w0, \w0, \p0
    bfi    r12, \w0, #\i, #1
    ldr.w  \w1, [r1, \w1, lsl #2]
.endm

@ Bits \i to \i + 3.
.macro hivtac_threshold_bits_four i
    hivtac_threshold_bits_pixel \i, 2 * \i + 4, r4, r5, r6, r7, r8
    hivtac_threshold_bits_pixel \i + 1, 2 * \i + 6, r6, r7, r8, r9, r10
    hivtac_threshold_bits_pixel \i + 2, 2 * \i + 8, r8, r9, r10, r11, r4
    hivtac_threshold_bits_pixel \i + 3, 2 * \i + 10, r10, r11, r4, r5, r6
.endm

hivtac_threshold_bits:
    push   {r0, r4-r11, lr}
    ldrh   r4, [r0]
    ldrh   r6, [r0, #2]
    lsr.w  r5, r4, #5
    ldr.w  r5, [r1, r5, lsl #2]
.Lhivtac_threshold_bits_word:
    hivtac_threshold_bits_four 0
    hivtac_threshold_bits_four 4
    hivtac_threshold_bits_four 8
    hivtac_threshold_bits_four 12
    hivtac_threshold_bits_four 16
    hivtac_threshold_bits_four 20
    hivtac_threshold_bits_four 24
    add    r2, r2, #4
    hivtac_threshold_bits_pixel 28, 60, r4, r5, r6, r7, r8
    hivtac_threshold_bits_pixel 29, 62, r6, r7, r8, r9, r10
    add    r0, r0, #64
    cmp    r2, r3
    it     eq
    ldreq  r0, [sp]
    hivtac_threshold_bits_pixel 30, 0, r8, r9, r10, r11, r4
    hivtac_threshold_bits_pixel 31, 2, r10, r11, r4, r5, r6
    str    r12, [r2, #-4]
    bne.w  .Lhivtac_threshold_bits_word
    pop    {r0, r4-r11, pc}
    .size hivtac_threshold_bits, . - hivtac_threshold_bits
