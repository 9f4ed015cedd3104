@ The mask of mono pixels: see `threshold_luma` in cortex_m7.rs.
@
@ r0 pixels   r1 the lowest luma, four times   r2 where the mask goes   r3 its end
@ r4-r8 pixels, then their bits   r10 0x08040201   r11 0   r12 the word of the mask
@ lr the highest luma less the lowest, four times
@
@ Four pixels at a time are made relative to the lowest luma and compared with the highest; each
@ that passes chooses its bit of four, and a sum over bytes brings eight of these together. The
@ order is a search's, judged by LLVM's model of the core: 46 instructions and the branch, and
@ 36 cycles; 28 of them can only go one a cycle.

    .syntax unified
    .section .itcm.hivtac_threshold_luma, "ax", %progbits
    .balign 8
    .global hivtac_threshold_luma
    .type hivtac_threshold_luma, %function
    .thumb_func

hivtac_threshold_luma:
    push   {r4-r11, lr}
    movw   r10, #0x0201
    ldr    lr, [sp, #36]
    movt   r10, #0x0804
    mov    r11, #0
.Lhivtac_threshold_luma_word:
    ldr.w  r5, [r0, #4]
    ldr.w  r4, [r0, #0]
    usub8  r4, r4, r1
    usub8  r5, r5, r1
    ldr.w  r6, [r0, #8]
    usub8  r4, lr, r4
    sel    r4, r10, r11
    ldr.w  r7, [r0, #12]
    usub8  r5, lr, r5
    sel    r5, r10, r11
    usub8  r6, r6, r1
    usub8  r7, r7, r1
    usub8  r6, lr, r6
    orr.w  r4, r4, r5, lsl #4
    sel    r6, r10, r11
    usad8  r12, r4, r11
    usub8  r7, lr, r7
    ldr.w  r8, [r0, #16]
    sel    r7, r10, r11
    usub8  r8, r8, r1
    ldr.w  r4, [r0, #20]
    usub8  r4, r4, r1
    orr.w  r6, r6, r7, lsl #4
    usad8  r6, r6, r11
    usub8  r8, lr, r8
    ldr.w  r5, [r0, #24]
    sel    r8, r10, r11
    usub8  r4, lr, r4
    orr.w  r12, r12, r6, lsl #8
    sel    r4, r10, r11
    usub8  r5, r5, r1
    ldr.w  r6, [r0, #28]
    usub8  r6, r6, r1
    usub8  r5, lr, r5
    sel    r5, r10, r11
    orr.w  r8, r8, r4, lsl #4
    usub8  r6, lr, r6
    sel    r6, r10, r11
    usad8  r8, r8, r11
    orr.w  r5, r5, r6, lsl #4
    add.w  r0, r0, #32
    usad8  r5, r5, r11
    orr.w  r12, r12, r8, lsl #16
    orr.w  r12, r12, r5, lsl #24
    str    r12, [r2], #4
    cmp    r2, r3
    bne.w  .Lhivtac_threshold_luma_word
    pop    {r4-r11, pc}
    .size hivtac_threshold_luma, . - hivtac_threshold_luma
