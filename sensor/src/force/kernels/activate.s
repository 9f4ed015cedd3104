@ From sums to activations: see `activate` in cortex_m7.rs for what it computes and why it is exact.
@
@ r0 biases   r1 multipliers   r2 shifts   r3 sums   r4-r7 four rows   r8, r9 loaded
@ r10 their shifts − 33   r11 33 in each byte   r12 where activations go
@ lr the largest activation, twice   stack: where activations go, their end, the largest twice

    .syntax unified
    .section .itcm.hivtac_activate, "ax", %progbits
    .balign 8
    .global hivtac_activate
    .type hivtac_activate, %function
    .thumb_func
hivtac_activate:
    push   {r4-r11, lr}
    ldr    r12, [sp, #36]
    ldr    lr, [sp, #44]
    mov    r11, #0x21212121
.Lhivtac_activate_four:
    ldr    r4, [r0]
    ldr    r8, [r3]
    ldr    r5, [r0, #4]
    ldr    r9, [r3, #4]
    ldr    r6, [r0, #8]
    add    r4, r4, r8
    ldr    r8, [r1]
    add    r5, r5, r9
    ldr    r9, [r1, #4]
    ldr    r7, [r0, #12]
    smmul  r4, r4, r8
    ldr    r8, [r3, #8]
    smmul  r5, r5, r9
    ldr    r9, [r3, #12]
    ldr    r10, [r2]
    add    r6, r6, r8
    ldr    r8, [r1, #8]
    add    r7, r7, r9
    ldr    r9, [r1, #12]
    usub8  r10, r10, r11
    add    r0, r0, #16
    asr    r4, r4, r10
    smmul  r6, r6, r8
    lsr    r8, r10, #8
    smmul  r7, r7, r9
    asr    r5, r5, r8
    add    r1, r1, #16
    lsr    r9, r10, #16
    add    r2, r2, #4
    lsr    r8, r10, #24
    add    r4, r4, #1
    asr    r6, r6, r9
    add    r5, r5, #1
    asr    r7, r7, r8
    add    r6, r6, #1
    usat   r4, #15, r4, asr #1
    add    r7, r7, #1
    usat   r5, #15, r5, asr #1
    add    r3, r3, #16
    usat   r6, #15, r6, asr #1
    ldr    r10, [sp, #40]
    usat   r7, #15, r7, asr #1
    add    r12, r12, #8
    pkhbt  r4, r4, r5, lsl #16
    pkhbt  r6, r6, r7, lsl #16
    usub16 r8, r4, lr
    sel    r4, lr, r4
    usub16 r9, r6, lr
    str    r4, [r12, #-8]
    sel    r6, lr, r6
    cmp    r12, r10
    str    r6, [r12, #-4]
    bne.w  .Lhivtac_activate_four
    pop    {r4-r11, pc}
    .size hivtac_activate, . - hivtac_activate
