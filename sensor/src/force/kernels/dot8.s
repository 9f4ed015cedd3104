@ Sums of an int8 layer by composite lanes: see `dot8` in cortex_m7.rs for what it computes and why
@ it is exact.
@
@ r0 weights   r1 inputs   r2-r5 sums of four rows   r6, r7 inputs of four columns
@ r8, r9 weights, loaded ahead   r10, r11 low bytes of the weights   r12 where sums go
@ lr blocks left   stack: inputs, blocks, end of sums
@
@ Schedule: every SMLAD goes with an instruction of another unit, so that both of a pair issue in
@ one cycle; weights are loaded four instructions, and the next four inputs one pair, before they
@ are used.

    .syntax unified
    .section .itcm.hivtac_dot8, "ax", %progbits
    .balign 8
    .global hivtac_dot8
    .type hivtac_dot8, %function
    .thumb_func

@ Four columns of four rows, 16 products; \w and \x are the offsets of their weights and inputs in
@ the block.
.macro hivtac_dot8_columns w, x
    sxtb16 r10, r8
    smlad  r2, r8, r7, r2
    ldr.w  r8, [r0, #\w + 8]
    smlad  r2, r10, r6, r2
    sxtb16 r11, r9
    smlad  r3, r9, r7, r3
    ldr.w  r9, [r0, #\w + 12]
    smlad  r3, r11, r6, r3
    sxtb16 r10, r8
    smlad  r4, r8, r7, r4
    ldr.w  r8, [r0, #\w + 16]
    smlad  r4, r10, r6, r4
    sxtb16 r11, r9
    smlad  r5, r9, r7, r5
    ldr.w  r9, [r0, #\w + 20]
    smlad  r5, r11, r6, r5
    ldr.w  r7, [r1, #\x + 12]
    ldr.w  r6, [r1, #\x + 8]
.endm

hivtac_dot8:
    push   {r1, r2, r4-r11, lr}
    mov    r12, r3
    ldr    r8, [r0]
    ldr    r9, [r0, #4]
.Lhivtac_dot8_rows:
    ldrd   r1, lr, [sp]
    movs   r2, #0
    movs   r3, #0
    ldr    r7, [r1, #4]
    movs   r4, #0
    ldr    r6, [r1]
    movs   r5, #0
    .balign 8
.Lhivtac_dot8_block:
    hivtac_dot8_columns 0, 0
    hivtac_dot8_columns 16, 8
    hivtac_dot8_columns 32, 16
    hivtac_dot8_columns 48, 24
    hivtac_dot8_columns 64, 32
    hivtac_dot8_columns 80, 40
    hivtac_dot8_columns 96, 48
    hivtac_dot8_columns 112, 56
    add.w  r0, r0, #128
    subs.w lr, lr, #1
    add.w  r1, r1, #64
    bne.w  .Lhivtac_dot8_block
    ldr    r10, [sp, #44]
    asrs   r2, r2, #8
    asrs   r3, r3, #8
    asrs   r4, r4, #8
    asrs   r5, r5, #8
    stm    r12!, {r2-r5}
    cmp    r12, r10
    bne.w  .Lhivtac_dot8_rows
    pop    {r1, r2, r4-r11, pc}
    .size hivtac_dot8, . - hivtac_dot8

@ Inputs a0 a1 | a2 a3 become 256·a0 − a1, 256·a2 − a3 | a1, a3, in place: r0 inputs, r1 groups of
@ eight.
    .section .itcm.hivtac_expand, "ax", %progbits
    .balign 8
    .global hivtac_expand
    .type hivtac_expand, %function
    .thumb_func
hivtac_expand:
    push   {r4, r5, r6, lr}
.Lhivtac_expand_eight:
    ldr    r2, [r0]
    ldr    r3, [r0, #4]
    ldr    r4, [r0, #8]
    pkhbt  r12, r2, r3, lsl #16
    ldr    r5, [r0, #12]
    pkhtb  r3, r3, r2, asr #16
    subs   r1, r1, #1
    pkhbt  r6, r4, r5, lsl #16
    lsl.w  r12, r12, #8
    pkhtb  r5, r5, r4, asr #16
    lsl.w  r6, r6, #8
    ssub16 r12, r12, r3
    str    r3, [r0, #4]
    ssub16 r6, r6, r5
    str    r12, [r0]
    str    r5, [r0, #12]
    str    r6, [r0, #8]
    add    r0, r0, #16
    bne.w  .Lhivtac_expand_eight
    pop    {r4, r5, r6, pc}
    .size hivtac_expand, . - hivtac_expand
