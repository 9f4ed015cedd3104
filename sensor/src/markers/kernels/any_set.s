@ Whether words of the mask have a set bit: see `any_set` in cortex_m7.rs.
@
@ r0 words, then all of them in one   r1 how many are left   r2-r5 some of them
@ r6, r12 those before them in one

    .syntax unified
    .section .itcm.hivtac_dilate_any_set, "ax", %progbits
    .balign 8
    .global hivtac_dilate_any_set
    .type hivtac_dilate_any_set, %function
    .thumb_func

hivtac_dilate_any_set:
    push   {r4-r6}
    movs   r6, #0
    mov.w  r12, #0
.Lhivtac_dilate_any_set_sixteen:
    ldr    r2, [r0]
    ldr    r3, [r0, #4]
    ldr    r4, [r0, #8]
    ldr    r5, [r0, #12]
    orr.w  r12, r12, r2
    ldr    r2, [r0, #16]
    orr.w  r6, r6, r3
    ldr    r3, [r0, #20]
    orr.w  r12, r12, r4
    ldr    r4, [r0, #24]
    orr.w  r6, r6, r5
    ldr    r5, [r0, #28]
    orr.w  r12, r12, r2
    ldr    r2, [r0, #32]
    orr.w  r6, r6, r3
    ldr    r3, [r0, #36]
    orr.w  r12, r12, r4
    ldr    r4, [r0, #40]
    orr.w  r6, r6, r5
    ldr    r5, [r0, #44]
    orr.w  r12, r12, r2
    ldr    r2, [r0, #48]
    orr.w  r6, r6, r3
    ldr    r3, [r0, #52]
    orr.w  r12, r12, r4
    ldr    r4, [r0, #56]
    orr.w  r6, r6, r5
    ldr    r5, [r0, #60]
    add.w  r0, r0, #64
    subs   r1, r1, #16
    orr.w  r12, r12, r2
    orr.w  r6, r6, r3
    orr.w  r12, r12, r4
    orr.w  r6, r6, r5
    bne    .Lhivtac_dilate_any_set_sixteen
    orr.w  r0, r12, r6
    pop    {r4-r6}
    bx     lr
    .size hivtac_dilate_any_set, . - hivtac_dilate_any_set
